// The program that a person runs, by real libusb, in a process of its own beside the emulated radar's.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <string>

namespace {

struct Outcome {
  std::string output;  ///< both streams
  int status = -1;
};

Outcome run(const std::string& command) {
  Outcome outcome;
  FILE* const pipe = popen(("exec 2>&1; " + command).c_str(), "r");
  if (!pipe) return outcome;
  std::array<char, 256> part;
  while (std::fgets(part.data(), part.size(), pipe)) outcome.output += part.data();
  const int status = pclose(pipe);
  if (WIFEXITED(status)) outcome.status = WEXITSTATUS(status);
  return outcome;
}

std::string radarFile(const std::string& more) {
  const std::string file = testing::TempDir() + "configure_radar.yaml";
  std::ofstream(file) << "device: awr2243\ncarrier_hz: 77.0e+9\nslope_hz_per_s: 75.0e+12\nsamples_per_chirp: 64\n"
                         "sample_rate_hz: 5.0e+6\nadc_start_s: 6.0e-6\nloops_per_frame: 1\nframe_period_s: 0.05\n"
                         "tx_position_m: [[0, 0, 0], [0, 0.0077867, 0]]\n"
                         "rx_position_m: [[0, 0, 0], [0, 0.0019467, 0], [0, 0.0038934, 0], [0, 0.0058401, 0]]\n"
                      << more;
  return file;
}

const char kDevice[] =
    "idle_s: 7.0e-6\nramp_end_s: 20.0e-6\ntx_enable: [[0], [2]]\nrx_enable: [0, 1, 2, 3]\nrx_gain_db: 40\n"
    "tx_backoff_db: 0\nif_highpass_hz: [175.0e+3, 350.0e+3]\n";
const std::string kProgram = MMRADARTWIN_CONFIGURE_RADAR;
const std::string kEmulated = std::string(MMRADARTWIN_RADAR_EMULATOR) + " ";

TEST(ConfigureRadar, RunsFramesAndPrintsTheQuantisedValues) {
  const Outcome outcome = run(kEmulated + kProgram + " " + radarFile(kDevice) + " --duration-s 0.3");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("slope_hz_per_s: 74978470802307"), std::string::npos) << outcome.output;
  const std::size_t up = outcome.output.find("RF calibration done (45 deg C)");
  const std::size_t running = outcome.output.find("frames run");
  const std::size_t ended = outcome.output.find("frames ended");
  ASSERT_NE(ended, std::string::npos) << outcome.output;
  EXPECT_LT(up, running);
  EXPECT_LT(running, ended);
}

TEST(ConfigureRadar, AnEmptyFlashAndTheImageForIt) {
  const std::string radar = radarFile(kDevice);
  Outcome outcome = run(kEmulated + "--no-firmware " + kProgram + " " + radar + " --duration-s 0.1");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.output.find("error: the radar has no firmware"), std::string::npos) << outcome.output;
  const std::string image = testing::TempDir() + "configure_radar.bin";
  std::ofstream(image, std::ios::binary) << std::string(5000, 'i');
  outcome = run(kEmulated + "--no-firmware " + kProgram + " " + radar + " --duration-s 0.1 --firmware " + image);
  EXPECT_EQ(outcome.status, 0) << outcome.output;
}

TEST(ConfigureRadar, BadInputEndsWithTwo) {
  Outcome outcome = run(kProgram + " --check " + radarFile(""));
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.output.find("key idle_s, ramp_end_s, tx_enable"), std::string::npos) << outcome.output;
  outcome = run(kProgram + " --check " + radarFile(kDevice));
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_EQ(run(kEmulated).status, 2);
}

}  // namespace
