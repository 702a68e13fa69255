// The rig as a whole against the emulator: configuration, arming, recovery.
#include "mmradartwin_driver/rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "emulated_rig.h"
#include "mmradartwin_driver/radar_devices.h"
#include "mmradartwin_driver/rig_error.h"
#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

struct RunningRig {
  explicit RunningRig(const RadarConfig& radar, const RigOptions& rig_options = options())
      : rig(
            radar, rig_options, [this](AdcCube&& cube) { take(std::move(cube)); },
            [this](Rig::Level, const std::string& text) {
              const std::lock_guard<std::mutex> lock(mutex);
              events.push_back(text);
            }) {}
  static RigOptions options() {
    RigOptions options;
    options.host_ip = loopbackIp(1);
    options.card_ip = loopbackIp(2);
    return options;
  }
  void take(AdcCube&& cube) {
    const std::lock_guard<std::mutex> lock(mutex);
    cubes.push_back(std::move(cube));
    changed.notify_all();
  }
  bool waitForCubes(std::size_t count, int seconds = 60) {
    std::unique_lock<std::mutex> lock(mutex);
    return changed.wait_for(lock, std::chrono::seconds(seconds), [&] { return cubes.size() >= count; });
  }
  bool saw(const std::string& text) {
    const std::lock_guard<std::mutex> lock(mutex);
    for (const std::string& event : events) {
      if (event.find(text) != std::string::npos) return true;
    }
    return false;
  }

  std::mutex mutex;
  std::condition_variable changed;
  std::vector<AdcCube> cubes;
  std::vector<std::string> events;
  Rig rig;  // last: its thread uses the rest
};

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::vector<std::string> quickly(const std::string& session, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {session, "--start-delay-s", "0.1", "--flush-s", "0.2", "--deaf-s", "0.1"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

std::vector<std::int16_t> frameOf(const TestFolder& folder, const RadarConfig& radar, std::size_t i) {
  std::vector<std::int16_t> samples;
  decodeFrame(radar, readBytes(folder.file("captures/a.bin")).data() + i * 2048, samples);
  return samples;
}

TEST(Rig, ConfiguresArmsAndRecords) {
  TestFolder folder;
  writeSession(folder, 0.01, {30});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  EmulatorProcess emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file("")));
  RunningRig running(radar);
  ASSERT_TRUE(running.waitForCubes(30));
  for (std::size_t i = 0; i < 30; ++i) {
    EXPECT_EQ(i, running.cubes[i].sequence);
    EXPECT_EQ(frameOf(folder, radar, i), running.cubes[i].data);
  }
  EXPECT_TRUE(emulator.waitFor("completed"));
  // Armed anew for the next frames when the recording was completed.
  EXPECT_TRUE(waitUntil([&] { return running.rig.state().armings == 2; }));
  const RigState state = running.rig.state();
  EXPECT_EQ("", state.problem);
  EXPECT_EQ(30u, state.frames.frames);
  EXPECT_EQ(0u, state.frames.lost_bytes);
  ASSERT_TRUE(state.version);
  EXPECT_EQ(8, state.version->minor);
  EXPECT_TRUE(running.saw("completed its recording"));
}

TEST(Rig, ArmsAnewWhenTheCardThrewSamplesAway) {
  TestFolder folder;
  writeSession(folder, 0.01, {400});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  EmulatorProcess emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file(""), {"--status-at", "40:0x80"}));
  RunningRig running(radar);
  // The count begins anew, and the frames are whole ones of the radar again.
  const auto second_start = [&running] {
    return std::find_if(
        running.cubes.begin() + std::min<std::ptrdiff_t>(1, running.cubes.end() - running.cubes.begin()),
        running.cubes.end(), [](const AdcCube& cube) { return cube.sequence == 0; });
  };
  ASSERT_TRUE(waitUntil([&] {
    const std::lock_guard<std::mutex> lock(running.mutex);
    return running.cubes.end() - second_start() > 1;
  }));
  EXPECT_TRUE(running.saw("DDR_FULL"));
  const std::lock_guard<std::mutex> lock(running.mutex);
  const auto again = second_start();
  std::size_t first = 0;
  while (first < 400 && frameOf(folder, radar, first) != again->data) ++first;
  ASSERT_LT(first, 399u) << "frames after arming anew are none of the radar's";
  EXPECT_GE(first, 40u);
  EXPECT_EQ(frameOf(folder, radar, first + 1), (again + 1)->data);
}

TEST(Rig, ACompletedRecordingIsLeftThoughSamplesGoOn) {
  TestFolder folder;
  writeSession(folder, 0.01, {600});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  EmulatorProcess emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file(""), {"--status-at", "40:0x100"}));
  RunningRig running(radar);
  ASSERT_TRUE(waitUntil([&] { return running.saw("completed its recording"); }));
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(waitUntil([&] { return running.rig.state().armings == 2; }));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));  // the session lasts for 6 s
  ASSERT_TRUE(waitUntil([&] { return running.rig.state().phase == RigState::Phase::kStreaming; }));
  EXPECT_LT(running.rig.state().silent_s, 1);
}

TEST(Rig, WaitsForACardAndComesBackToOneThatWasGone) {
  TestFolder folder;
  writeSession(folder, 0.01, {400});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  RunningRig running(radar);
  EXPECT_TRUE(waitUntil([&] { return holds(running.rig.state().problem, "no answer from the DCA1000"); }))
      << running.rig.state().problem;
  {
    EmulatorProcess emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file("")));
    ASSERT_TRUE(running.waitForCubes(50));
    EXPECT_EQ("", running.rig.state().problem);
  }  // power lost in the middle
  // What the card had sent is taken once the rig has seen nothing for a while.
  ASSERT_TRUE(waitUntil([&] { return running.rig.state().silent_s > 0.3; }));
  std::size_t before;
  {
    const std::lock_guard<std::mutex> lock(running.mutex);
    before = running.cubes.size();
  }
  EmulatorProcess emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file("")));
  ASSERT_TRUE(running.waitForCubes(before + 50));
  const std::lock_guard<std::mutex> lock(running.mutex);
  // A frame that was cut off comes first.
  const std::size_t cut = running.cubes[before].sequence == 0 ? 0 : 1;
  EXPECT_EQ(cut == 1, running.cubes[before].lost_bytes > 0);
  EXPECT_EQ(0u, running.cubes[before + cut].sequence);
  EXPECT_EQ(frameOf(folder, radar, 0), running.cubes[before + cut].data);
}

TEST(Rig, NamesAHostAddressThatIsMissing) {
  RigOptions options = RunningRig::options();
  options.host_ip = "203.0.113.7";
  TestFolder folder;
  writeText(folder.file("radar.yaml"), paperRadarYaml(0.05));
  const Rig rig(
      loadRadarConfig(folder.file("radar.yaml")), options, [](AdcCube&&) {}, [](Rig::Level, const std::string&) {});
  EXPECT_TRUE(waitUntil([&] { return holds(rig.state().problem, "no address 203.0.113.7"); })) << rig.state().problem;
}

TEST(Rig, LooksAtTheCardsVersion) {
  TestFolder folder;
  writeSession(folder, 0.01, {30});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  {
    EmulatorProcess emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file(""), {"--fpga-version", "0x4402"}));
    RunningRig running(radar);
    EXPECT_TRUE(waitUntil([&] { return holds(running.rig.state().problem, "playback image: load TI's record image"); }))
        << running.rig.state().problem;
    EXPECT_EQ(0u, running.rig.state().armings);
  }
  EmulatorProcess emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file(""), {"--fpga-version", "0x0282"}));
  RunningRig running(radar);
  EXPECT_TRUE(running.waitForCubes(30));  // an unknown one is tried
  EXPECT_TRUE(running.saw("FPGA 2.5: the driver is made after FPGA 2.7 to 2.9"));
}

/// A radar that no driver knows: it writes down what is asked of it, and fails as often as it is told to.
class MadeUpRadar : public RadarControl {
 public:
  struct Log {
    std::mutex mutex;
    std::vector<std::string> calls;
    int failures = 0;
    void add(const std::string& call) {
      const std::lock_guard<std::mutex> lock(mutex);
      calls.push_back(call);
    }
    std::vector<std::string> all() {
      const std::lock_guard<std::mutex> lock(mutex);
      return calls;
    }
  };
  explicit MadeUpRadar(std::shared_ptr<Log> log) : log_(std::move(log)) {}
  ~MadeUpRadar() override { log_->add("gone"); }
  bool configure() override {
    log_->add("configure");
    if (log_->failures-- > 0) throw RigError("the made-up radar is asleep: wake it");
    const bool anew = !health_.configured;
    health_.configured = true;
    health_.version = "7.1";
    return anew;
  }
  void start() override { log_->add("start"); }
  void stop() override { log_->add("stop"); }
  void forget() override { health_.configured = false; }
  RadarHealth health() const override { return health_; }

 private:
  std::shared_ptr<Log> log_;
  RadarHealth health_;
};

/// A session whose radar.yaml names the made-up device, which is known from then on under that name.
RigOptions optionsFor(const std::string& name, const std::shared_ptr<MadeUpRadar::Log>& log, RadarConfig& radar) {
  radar.device = name;
  registerRadarDevice({name,
                       "Made-up radar",
                       [](const RadarConfig& config, const std::string&) { return config; },
                       [log](const RadarConfig&, const std::string&, RadarControl::EventSink) {
                         return std::make_unique<MadeUpRadar>(log);
                       },
                       {}});
  RigOptions options = RunningRig::options();
  options.radar = radarDevice(radar, "radar.yaml");
  return options;
}

TEST(Rig, DrivesARadarOfAnotherKindInTheSameOrder) {
  TestFolder folder;
  writeSession(folder, 0.01, {30});
  RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  const auto log = std::make_shared<MadeUpRadar::Log>();
  const RigOptions options = optionsFor("made_up", log, radar);
  {
    EmulatorProcess emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file("")));
    RunningRig running(radar, options);
    ASSERT_TRUE(running.waitForCubes(10));
    const RigState state = running.rig.state();
    ASSERT_TRUE(state.radar);
    EXPECT_TRUE(state.radar->configured);
    EXPECT_EQ("7.1", state.radar->version);
    EXPECT_TRUE(running.saw("Made-up radar configured, firmware 7.1"));
  }
  const std::vector<std::string> calls = log->all();
  const auto configured = std::find(calls.begin(), calls.end(), "configure");
  const auto started = std::find(calls.begin(), calls.end(), "start");
  ASSERT_NE(calls.end(), started);
  EXPECT_LT(configured, started);
  EXPECT_EQ("gone", calls.back());
}

TEST(Rig, SaysWhatARadarOfAnotherKindMissesAndTriesAgain) {
  TestFolder folder;
  writeSession(folder, 0.01, {30});
  RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  const auto log = std::make_shared<MadeUpRadar::Log>();
  log->failures = 1;
  const RigOptions options = optionsFor("made_up_sleeper", log, radar);
  EmulatorProcess emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file("")));
  RunningRig running(radar, options);
  ASSERT_TRUE(running.waitForCubes(10));
  EXPECT_TRUE(running.saw("the made-up radar is asleep: wake it"));
  EXPECT_EQ("", running.rig.state().problem);
}

TEST(RadarDevices, AnUnknownDeviceIsRefusedWithTheKnownOnes) {
  RadarConfig radar;
  radar.device = "awr9999";
  try {
    radarDevice(radar, "my_radar.yaml");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    for (const char* part : {"my_radar.yaml", "device", "awr9999", "awr2243"}) {
      EXPECT_TRUE(holds(error.what(), part)) << error.what();
    }
  }
  EXPECT_THROW(registerRadarDevice({"awr2243", "", {}, {}, {}}), InputError) << "a name that is taken";
}

}  // namespace
}  // namespace mmradartwin
