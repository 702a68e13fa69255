// The doctor's self-test: its judgement on bytes made here, and the program against an emulated rig with good and with
// wrong wiring.
#include "awr2243/rig_self_test.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdlib>

#include "emulated_rig.h"

namespace mmradartwin {
namespace {

using Level = CheckResult::Level;

const char kDevice[] =
    "idle_s: 7.0e-6\nramp_end_s: 20.0e-6\ntx_enable: [[0], [2]]\nrx_enable: [0, 1, 2, 3]\nrx_gain_db: 40\n"
    "tx_backoff_db: 0\nif_highpass_hz: [175.0e+3, 350.0e+3]\n";

RadarConfig deviceRadar() { return parseRadarConfig(paperRadarYaml(0.05) + kDevice, "radar.yaml"); }

using Words = std::vector<std::uint16_t>;

std::vector<std::uint8_t> bytesOf(const Words& words) {
  std::vector<std::uint8_t> bytes;
  for (const std::uint16_t word : words) {
    bytes.push_back(static_cast<std::uint8_t>(word & 0xFF));
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  }
  return bytes;
}

/// Four packets of ramps as the lanes would carry them: I of lanes 0 to 3, then Q; receiver lane_rx[k] on lane k.
Words patternWords(const std::array<int, 4>& lane_rx, bool q_first) {
  const awr2243::TestPattern pattern = selfTestPattern();
  Words words;
  for (int packet = 0; packet < 4; ++packet) {
    for (int n = 0; n < pattern.samples; ++n) {
      for (const bool second : {false, true}) {
        for (const int rx : lane_rx) {
          const auto& ramp = second != q_first ? pattern.rx[rx].q : pattern.rx[rx].i;
          words.push_back(static_cast<std::uint16_t>(ramp.start + n * ramp.increment));
        }
      }
    }
  }
  return words;
}

TEST(SelfTestPattern, InOrder) {
  const CheckResult result = judgeTestPattern(deviceRadar(), bytesOf(patternWords({0, 1, 2, 3}, false)));
  EXPECT_EQ(result.level, Level::kFine) << result.found;
}

TEST(SelfTestPattern, NamesTheOrderOfTheLanes) {
  const CheckResult result = judgeTestPattern(deviceRadar(), bytesOf(patternWords({3, 2, 1, 0}, false)));
  EXPECT_EQ(result.level, Level::kProblem);
  EXPECT_NE(result.found.find("order 3 2 1 0"), std::string::npos) << result.found;
}

TEST(SelfTestPattern, NamesSwappedIAndQ) {
  const auto bytes = bytesOf(patternWords({0, 1, 2, 3}, true));
  EXPECT_NE(judgeTestPattern(deviceRadar(), bytes).found.find("Q comes where I should"), std::string::npos);
  RadarConfig radar = deviceRadar();
  radar.iq_order = IqOrder::kQi;
  EXPECT_EQ(judgeTestPattern(radar, bytes).level, Level::kFine);
}

TEST(SelfTestPattern, NamesSwappedBytes) {
  auto bytes = bytesOf(patternWords({0, 1, 2, 3}, false));
  for (std::size_t i = 0; i < bytes.size(); i += 2) std::swap(bytes[i], bytes[i + 1]);
  EXPECT_NE(judgeTestPattern(deviceRadar(), bytes).found.find("bytes of each word"), std::string::npos);
}

TEST(SelfTestPattern, ASingleWrongBitIsSeen) {
  auto bytes = bytesOf(patternWords({0, 1, 2, 3}, false));
  bytes[bytes.size() / 2] ^= 0x10;
  EXPECT_EQ(judgeTestPattern(deviceRadar(), bytes).level, Level::kProblem);
}

/// What the test source's description says, as samples: x = I + jQ of the dechirped echo, by the exact two-way path.
Words sourceWords(const RadarConfig& radar, const std::array<int, 4>& lane_rx, bool conjugate) {
  const awr2243::TestSource source = selfTestSource(radar);
  const double light = 299792458.0, pi = std::acos(-1.0), eighth_m = light / radar.carrier_hz / 8;
  Words words;
  for (int n = 0; n < radar.samples_per_chirp; ++n) {
    std::array<std::complex<double>, 4> x{};
    for (int rx = 0; rx < 4; ++rx) {
      for (const awr2243::TestTarget& target : source.targets) {
        const double px = 0.01 * target.position_cm[0], py = 0.01 * target.position_cm[1];
        const double rx_m = source.rx_position[rx][0] * eighth_m;
        const double tau_s = (std::hypot(px, py) + std::hypot(px - rx_m, py)) / light;
        const double t_s = radar.adc_start_s + n / radar.sample_rate_hz;
        const double phase = 2 * pi * (radar.carrier_hz * tau_s + radar.slope_hz_per_s * tau_s * (t_s - tau_s / 2));
        x[rx] += std::polar(8000.0, phase);
      }
      if (conjugate) x[rx] = {x[rx].imag(), x[rx].real()};  // swapped I and Q
    }
    for (const int rx : lane_rx) words.push_back(static_cast<std::uint16_t>(std::lround(x[rx].real())));
    for (const int rx : lane_rx) words.push_back(static_cast<std::uint16_t>(std::lround(x[rx].imag())));
  }
  return words;
}

TEST(SelfTestSource, TellsTheFourWiringsApart) {
  const RadarConfig radar = deviceRadar();
  const auto judged = [&](const std::array<int, 4>& lane_rx, bool conjugate) {
    return judgeTestSource(radar, bytesOf(sourceWords(radar, lane_rx, conjugate)));
  };
  const CheckResult fine = judged({0, 1, 2, 3}, false);
  EXPECT_EQ(fine.level, Level::kFine) << fine.found;
  EXPECT_NE(judged({3, 2, 1, 0}, false).found.find("angles have the wrong sign"), std::string::npos);
  const std::string swapped = judged({0, 1, 2, 3}, true).found;
  EXPECT_EQ(swapped.find("I and Q are swapped:"), 0u) << swapped;
  const std::string both = judged({3, 2, 1, 0}, true).found;
  EXPECT_EQ(both.find("I and Q are swapped and the receivers reversed"), 0u) << both;
}

TEST(SelfTestSource, NoiseHoldsNoTargets) {
  const RadarConfig radar = deviceRadar();
  const std::string noise = randomBytes(20 * 1024, 5);
  const CheckResult result = judgeTestSource(radar, std::vector<std::uint8_t>(noise.begin(), noise.end()));
  EXPECT_EQ(result.level, Level::kProblem);
  EXPECT_NE(result.found.find("not in the samples"), std::string::npos) << result.found;
}

#ifdef MMRADARTWIN_EMULATED_RIG
/// The program on an emulated rig of this process's own; its output.
std::string examine(const std::vector<std::string>& wiring, int expected_status) {
  TestFolder folder;
  writeSession(folder, 0.05, {20});
  writeText(folder.file("device.yaml"), paperRadarYaml(0.05) + kDevice);
  std::vector<std::string> arguments = {folder.file(""), "--loopback",  "--host-ip",        loopbackIp(1),
                                        "--card-ip",     loopbackIp(2), "--run-folder",     folder.file("rig"),
                                        "--deaf-s",      "0.1",         "--end-with-parent"};
  arguments.insert(arguments.end(), wiring.begin(), wiring.end());
  ChildProcess rig(MMRADARTWIN_EMULATED_RIG, arguments);
  const auto ready = rig.readLine(120000);
  EXPECT_TRUE(ready && ready->compare(0, 5, "ready") == 0);
  const std::string buffer_mb = geteuid() == 0 ? "4" : "0.2";  // what any kernel grants
  const std::string command = "MMRADARTWIN_EMULATED_RIG=" + folder.file("rig") + " " MMRADARTWIN_WITH_EMULATED_USB " " +
                              MMRADARTWIN_DOCTOR + " --self-test --buffer-mb " + buffer_mb + " --host-ip " +
                              loopbackIp(1) + " --card-ip " + loopbackIp(2) + " --radar " + folder.file("device.yaml") +
                              " >" + folder.file("out") + " 2>&1";
  const int status = WEXITSTATUS(std::system(command.c_str()));
  const auto output = readBytes(folder.file("out"));
  const std::string text(output.begin(), output.end());
  EXPECT_EQ(expected_status, status) << text;
  return text;
}

TEST(SelfTestProgram, AGoodRig) {
  const std::string output = examine({}, 0);
  EXPECT_NE(output.find("[ ok ] lane pattern: receivers in order 0 1 2 3"), std::string::npos) << output;
  EXPECT_NE(output.find("[ ok ] test source: both targets"), std::string::npos) << output;
}

TEST(SelfTestProgram, ReversedLanes) {
  const std::string output = examine({"--lanes-reversed"}, 2);
  EXPECT_NE(output.find("order 3 2 1 0"), std::string::npos) << output;
  EXPECT_NE(output.find("angles have the wrong sign"), std::string::npos) << output;
}

TEST(SelfTestProgram, SwappedIAndQ) {
  const std::string output = examine({"--iq-swapped"}, 2);
  EXPECT_NE(output.find("Q comes where I should"), std::string::npos) << output;
  EXPECT_NE(output.find("I and Q are swapped: the targets"), std::string::npos) << output;
}
#endif

}  // namespace
}  // namespace mmradartwin
