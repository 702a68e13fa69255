#include "mmradartwin_dsp/channel_correction.h"

#include <gtest/gtest.h>

#include "mmradartwin_dsp/average_pose.h"
#include "mmradartwin_dsp/range_angle.h"
#include "test_radar.h"
#include "test_session_folder.h"

namespace mmradartwin {
namespace {

const char* const kGood =
    "format: mmradartwin_channels/1\nphase_deg: [0, 12, -8, 5, 20, -15, 9, -4]\n"
    "gain_db: [0, 0.6, -0.4, 0.2, -0.8, 0.5, 0.3, -0.6]\n";

TEST(ChannelCorrection, TakesTheErrorOutOfATargetsMap) {
  const TestFolder folder;
  writeBytes(folder / "channels.yaml", kGood);
  const RadarConfig radar = paperRadar();
  const ChannelCorrection correction = loadChannelCorrection(folder / "channels.yaml", radar);
  ReceiveGrid clean, measured;
  clean.x = pointTarget(radar, 3.0, 0.4, 1000);
  measured.x = clean.x;
  const double phase_deg[] = {0, 12, -8, 5, 20, -15, 9, -4}, gain_db[] = {0, 0.6, -0.4, 0.2, -0.8, 0.5, 0.3, -0.6};
  for (int k = 0; k < 8; ++k) {
    const double a = phase_deg[k] * M_PI / 180, g = std::pow(10.0, gain_db[k] / 20);
    measured.x.row(k) *= std::complex<double>(g * std::cos(a), g * std::sin(a));
  }
  const SignalChain chain(radar);
  const RealGrid wanted = chain.map(clean).power_db;
  EXPECT_GT((chain.map(measured).power_db - wanted).cwiseAbs().maxCoeff(), 1) << "the error does nothing";
  correctChannels(correction, measured.x);
  EXPECT_LT((chain.map(measured).power_db - wanted).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(ChannelCorrection, AveragesOfARecordingAreCorrected) {
  const TestFolder folder;
  writeSession(folder.path);
  writeBytes(folder / "channels.yaml", kGood);
  Recording recording = openSession(folder.path.string());
  const ReceiveGrid raw = averagePose(recording, recording.poses[1]);
  recording.channels = loadChannelCorrection(folder / "channels.yaml", recording.radar);
  const ReceiveGrid corrected = averagePose(recording, recording.poses[1]);
  EXPECT_TRUE(raw.x.row(0) == corrected.x.row(0));
  const std::complex<double> f = raw.x(4, 7) / corrected.x(4, 7);
  EXPECT_NEAR(std::arg(f) * 180 / M_PI, 20, 1e-9);
  EXPECT_NEAR(20 * std::log10(std::abs(f)), -0.8, 1e-9);
}

TEST(ChannelCorrection, WhatIsWrittenReadsBack) {
  const TestFolder folder;
  ChannelCorrection correction;
  for (int k = 0; k < 8; ++k) {
    correction.phase_deg.push_back(k / 3.0 - 1);
    correction.gain_db.push_back(0.1 * k);
  }
  writeBytes(folder / "channels.yaml", toYaml(correction));
  const ChannelCorrection read = loadChannelCorrection(folder / "channels.yaml");
  EXPECT_EQ(read.phase_deg, correction.phase_deg);
  EXPECT_EQ(read.gain_db, correction.gain_db);
}

TEST(ChannelCorrection, BadFilesAreNamedWithKeyAndRange) {
  const TestFolder folder;
  const std::string file = folder / "channels.yaml";
  const auto error = [&](const std::string& text) {
    writeBytes(file, text);
    return inputError([&] { loadChannelCorrection(file, paperRadar()); });
  };
  const std::string format = "format: mmradartwin_channels/1\n";
  const std::string eight = "[0, 1, 2, 3, 4, 5, 6, 7]\n", seven = "[0, 1, 2, 3, 4, 5, 6]\n";
  EXPECT_EQ(error(format + "phase_deg: " + eight + "gain_db: " + eight), "");
  EXPECT_TRUE(saysInOneLine(error(format + "phase_deg: " + seven + "gain_db: " + seven), "channels.yaml", "phase_deg",
                            "7 numbers", "8"));
  EXPECT_TRUE(saysInOneLine(error(format + "phase_deg: " + eight + "gain_db: " + seven), "gain_db", "7 numbers"));
  EXPECT_TRUE(saysInOneLine(error(format + "phase_deg: " + eight), "gain_db"));
  EXPECT_TRUE(saysInOneLine(error(format + "phase_deg: [0, 400, 0, 0, 0, 0, 0, 0]\ngain_db: " + eight), "phase_deg",
                            "400", "-360 to 360"));
  EXPECT_TRUE(saysInOneLine(error(format + "phase_deg: " + eight + "gain_db: [0, .nan, 0, 0, 0, 0, 0, 0]\n"), "gain_db",
                            "-60 to 60"));
  EXPECT_TRUE(saysInOneLine(error("phase_deg: " + eight + "gain_db: " + eight), "format"));
  EXPECT_TRUE(saysInOneLine(error("format: mmradartwin_calibration/1\nphase_deg: " + eight + "gain_db: " + eight),
                            "mmradartwin_calibration/1", "mmradartwin_channels/1"));
  EXPECT_TRUE(
      saysInOneLine(error(format + "phase_deg: " + eight + "gain_db: " + eight + "gain: 1\n"), "gain", "gain_db"));
  EXPECT_TRUE(saysInOneLine(inputError([] { loadChannelCorrection("/nowhere/channels.yaml"); }), "/nowhere"));
}

}  // namespace
}  // namespace mmradartwin
