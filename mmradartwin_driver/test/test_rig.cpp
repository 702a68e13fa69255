// The rig as a whole against the emulator: configuration, arming, recovery.
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>

#include "emulated_rig.h"
#include "mmradartwin_driver/rig.h"
#include "mmradartwin_dsp/capture.h"

namespace mmradartwin {
namespace {

struct RunningRig {
  explicit RunningRig(const RadarConfig& radar)
      : rig(
            radar, options(), [this](AdcCube&& cube) { take(std::move(cube)); },
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
  bool waitForCubes(std::size_t count, int seconds = 15) {
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

std::vector<std::string> quickly(const std::string& session, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {session, "--start-delay-s", "0.1", "--flush-s", "0.2", "--deaf-s", "0.1"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

std::vector<std::int16_t> frameOf(const TemporaryFolder& folder, const RadarConfig& radar, std::size_t i) {
  std::vector<std::int16_t> samples;
  decodeFrame(radar, readBytes(folder.file("captures/a.bin")).data() + i * 2048, samples);
  return samples;
}

TEST(Rig, ConfiguresArmsAndRecords) {
  TemporaryFolder folder;
  writeSession(folder, 0.01, {30});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  EmulatorProgram emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file("")));
  RunningRig running(radar);
  ASSERT_TRUE(running.waitForCubes(30));
  for (std::size_t i = 0; i < 30; ++i) {
    EXPECT_EQ(i, running.cubes[i].sequence);
    EXPECT_EQ(frameOf(folder, radar, i), running.cubes[i].data);
  }
  EXPECT_TRUE(emulator.waitFor("completed"));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const RigState state = running.rig.state();
  EXPECT_EQ("", state.problem);
  EXPECT_EQ(2u, state.armings);  // armed anew for the next frames when the recording was completed
  EXPECT_EQ(30u, state.frames.frames);
  EXPECT_EQ(0u, state.frames.lost_bytes);
  ASSERT_TRUE(state.version);
  EXPECT_EQ(8, state.version->minor);
  EXPECT_TRUE(running.saw("completed its recording"));
}

TEST(Rig, ArmsAnewWhenTheCardThrewSamplesAway) {
  TemporaryFolder folder;
  writeSession(folder, 0.01, {150});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  EmulatorProgram emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file(""), {"--status-at", "40:0x80"}));
  RunningRig running(radar);
  ASSERT_TRUE(running.waitForCubes(100));
  EXPECT_TRUE(running.saw("DDR_FULL"));
  const std::lock_guard<std::mutex> lock(running.mutex);
  // The count begins anew, and the frames are whole ones of the radar again.
  const auto again = std::find_if(running.cubes.begin() + 1, running.cubes.end(),
                                  [](const AdcCube& cube) { return cube.sequence == 0; });
  ASSERT_NE(running.cubes.end(), again);
  std::size_t first = 0;
  while (first < 150 && frameOf(folder, radar, first) != again->data) ++first;
  ASSERT_LT(first, 150u) << "frames after arming anew are none of the radar's";
  EXPECT_GE(first, 40u);
  EXPECT_EQ(frameOf(folder, radar, first + 1), (again + 1)->data);
}

TEST(Rig, WaitsForACardAndComesBackToOneThatWasGone) {
  TemporaryFolder folder;
  writeSession(folder, 0.01, {400});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  RunningRig running(radar);
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  EXPECT_NE(std::string::npos, running.rig.state().problem.find("no answer from the DCA1000"))
      << running.rig.state().problem;
  {
    EmulatorProgram emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file("")));
    ASSERT_TRUE(running.waitForCubes(50));
    EXPECT_EQ("", running.rig.state().problem);
  }  // power lost in the middle
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  std::size_t before;
  {
    const std::lock_guard<std::mutex> lock(running.mutex);
    before = running.cubes.size();
  }
  EmulatorProgram emulator(loopbackIp(1), loopbackIp(2), quickly(folder.file("")));
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
  TemporaryFolder folder;
  writeText(folder.file("radar.yaml"), paperRadarYaml(0.05));
  const Rig rig(
      loadRadarConfig(folder.file("radar.yaml")), options, [](AdcCube&&) {}, [](Rig::Level, const std::string&) {});
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_NE(std::string::npos, rig.state().problem.find("no address 203.0.113.7")) << rig.state().problem;
}

}  // namespace
}  // namespace mmradartwin
