#include "diagnosis/unexplained_frames.h"

#include <gtest/gtest.h>

#include <cmath>

#include "cabinet_twin.h"
#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis {
namespace {

/// Two poses at two places whose strongest tone has the amplitude 0.01 of full scale: its power over Hann's lobe of
/// 1/4, 1, 1/4 in amplitude is summed and divided by 1.5.
ChannelData toneOf(double amplitude) {
  ChannelData data = channelsAt({facingEastAt(0, 0), facingEastAt(1, 0)});
  for (PoseChannels& pose : data.poses) {
    pose.range_spectra = Eigen::MatrixXcd::Zero(data.radar.channels(), data.radar.samples_per_chirp);
    pose.range_spectra.col(20).setConstant(amplitude);
    pose.range_spectra.col(19).setConstant(-0.5 * amplitude);
    pose.range_spectra.col(21).setConstant(-0.5 * amplitude);
  }
  return data;
}

FrameFinding hum(double level_db) {
  FrameFinding frame;
  frame.cause = "unknown";
  frame.log_likelihood_gain = 40;
  frame.false_alarm_rate = 1e-4;
  frame.description = "a tone that stays";
  frame.poses = {"0"};
  frame.mechanism = defaultMechanism("tx_rx_leakage");
  frame.mechanism->values.set("level_db", level_db);
  return frame;
}

TEST(UnexplainedFrames, BecomeTheUnknownWithItsNats) {
  FrameFinding frame = hum(10);
  frame.mechanism.reset();
  frame.nats_by_pose = {{"0", 30}, {"1", 10}};
  Findings findings;
  std::vector<NamedParameters> extended;
  addUnexplained({frame}, toneOf(0.01), {}, findings, extended);
  ASSERT_EQ(findings.findings.size(), 1u);
  const Finding& finding = findings.findings[0];
  EXPECT_EQ(finding.cause, "unknown");
  EXPECT_EQ(finding.description, "a tone that stays");
  EXPECT_EQ(finding.evidence.log_likelihood_gain, 40);
  ASSERT_TRUE(finding.gain);
  EXPECT_NEAR(finding.gain->log_likelihood_per_pose.after, 20, 1e-12);
  EXPECT_TRUE(extended.empty());
}

// One count is 1/32768 of full scale; the strongest tone of 0.01 stands 20 log10(327.68) = 50.3 dB over it.
TEST(UnexplainedFrames, LevelsOfTheirTermsReferToTheStrongestEcho) {
  Findings findings;
  std::vector<NamedParameters> extended;
  addUnexplained({hum(30)}, toneOf(0.01), {}, findings, extended);
  ASSERT_EQ(extended.size(), 1u);
  EXPECT_NEAR(extended[0].values.number("level_db"), 30 - 20 * std::log10(327.68), 1e-9);
}

TEST(UnexplainedFrames, JoinAnUnknownThatStandsLast) {
  Findings findings;
  findings.findings.resize(1);
  findings.findings[0].cause = "unknown";
  findings.findings[0].description = "an echo of no name";
  std::vector<NamedParameters> extended;
  addUnexplained({hum(30)}, toneOf(0.01), {}, findings, extended);
  ASSERT_EQ(findings.findings.size(), 1u);
  EXPECT_EQ(findings.findings[0].description, "an echo of no name; besides: a tone that stays");
  EXPECT_EQ(extended.size(), 1u);
}

TEST(UnexplainedFrames, StandBehindANamedFinding) {
  Findings findings;
  findings.findings.resize(1);
  findings.findings[0].cause = "range_bias";
  std::vector<NamedParameters> extended;
  addUnexplained({hum(30)}, toneOf(0.01), {}, findings, extended);
  ASSERT_EQ(findings.findings.size(), 2u);
  EXPECT_EQ(findings.findings[0].cause, "range_bias");
  EXPECT_EQ(findings.findings[1].cause, "unknown");
}

}  // namespace
}  // namespace mmradartwin::diagnosis
