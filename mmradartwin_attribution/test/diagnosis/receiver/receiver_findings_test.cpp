#include "diagnosis/receiver/receiver_findings.h"

#include <gtest/gtest.h>

#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/channels/drawn_channels.h"

namespace mmradartwin::diagnosis {
namespace {

double value(const Finding& f, const std::string& name) { return std::get<double>(f.parameter(name)->value); }

TEST(ReceiverFindings, FrameFindingsKeepWhatFramesSaid) {
  FrameFinding frames;
  frames.cause = "phase_drift";
  frames.parameters = {{"rad_per_frame", "rad", 0.02, {{0.019, 0.021}}}};
  frames.log_likelihood_gain = 120;
  frames.false_alarm_rate = 1e-9;
  frames.poses = {"a", "b"};
  frames.description = "turns";
  const Finding f = findingOf(frames);
  EXPECT_EQ(f.cause, "phase_drift");
  ASSERT_TRUE(f.mechanism);
  EXPECT_EQ(f.mechanism->values.number("rad_per_frame"), 0.02);
  EXPECT_EQ(f.evidence.log_likelihood_gain, 120);
  ASSERT_EQ(f.where.size(), 1u);
  EXPECT_EQ(f.where[0].poses, frames.poses);
  EXPECT_NO_THROW(toJson(f));
  frames.cause = "unknown";
  frames.parameters.clear();
  EXPECT_FALSE(findingOf(frames).mechanism) << "no name, no mechanism of its own";
}

TEST(ReceiverFindings, ReversedOrderIsRatherAConjugation) {
  const RadarConfig radar = paperRadar();
  SampleConvention convention{defaultMechanism("channel_permutation"), 40, 3.0};
  convention.mechanism.values.set("order", std::vector<double>{7, 6, 5, 4, 3, 2, 1, 0});
  const Finding reversed = findingOf(convention, radar);
  EXPECT_EQ(reversed.cause, "channel_conjugation");
  EXPECT_EQ(reversed.mechanism->mechanism, "channel_conjugation");
  ASSERT_EQ(reversed.candidates.size(), 2u);
  EXPECT_TRUE(reversed.experiment);
  convention.mechanism.values.set("order", std::vector<double>{1, 0, 2, 3, 5, 4, 6, 7});
  const Finding exchanged = findingOf(convention, radar);
  EXPECT_EQ(exchanged.cause, "channel_permutation");
  EXPECT_EQ(exchanged.candidates.size(), 1u);
  EXPECT_EQ(std::get<std::vector<double>>(exchanged.parameter("order")->value)[0], 1);
  EXPECT_NEAR(exchanged.evidence.false_alarm_rate, 50 * std::exp(-40.0), 1e-20);
  EXPECT_EQ(*exchanged.evidence.margin, 3.0);
}

TEST(ReceiverFindings, TonesWithARangeLeakAndOthersAreConstant) {
  const RadarConfig radar = paperRadar();
  const ChannelData rest = sessionOf(radar, {gridOf(radar, {{3.0, 0.1, 0.02}})}, 1e-12);
  BodyFixedTone tone;
  tone.channels = Eigen::VectorXcd::Constant(8, 0.002);
  tone.channels[3] *= std::polar(2.0, 1.0);
  tone.gain = 300;
  tone.false_alarm_rate = 1e-12;
  tone.range_m = 0.06;
  tone.range_error_m = 0.001;
  const Finding leakage = findingOf(tone, rest);
  EXPECT_EQ(leakage.cause, "tx_rx_leakage");
  // rms of seven ones and a two, against the echo of 0.02.
  const double rms = 0.002 * std::sqrt((7 + 4) / 8.0);
  EXPECT_NEAR(value(leakage, "level_db"), 20 * std::log10(rms / 0.02), 0.2);
  EXPECT_EQ(value(leakage, "range_m"), 0.06);
  EXPECT_NEAR(leakage.mechanism->values.numbers("phase_deg")[3], 180 / M_PI, 1e-9);
  EXPECT_NEAR(leakage.mechanism->values.numbers("gain_db")[3], 20 * std::log10(0.004 / rms), 1e-9);
  tone.range_m = 0.004;
  const Finding offset = findingOf(tone, rest);
  EXPECT_EQ(offset.cause, "dc_offset");
  EXPECT_EQ(offset.parameter("range_m"), nullptr);
}

TEST(ReceiverFindings, ConventionsThatTieAreNoCertainty) {
  const RadarConfig radar = paperRadar();
  SampleConvention convention{defaultMechanism("channel_permutation"), 40, 0.0};
  NamedParameters other = convention.mechanism;
  convention.mechanism.values.set("order", std::vector<double>{3, 2, 1, 0, 7, 6, 5, 4});
  other.values.set("order", std::vector<double>{4, 5, 6, 7, 0, 1, 2, 3});
  convention.alike = {{convention.mechanism, 0.5}, {other, 0.5}};
  const Finding tie = findingOf(convention, radar);
  EXPECT_EQ(tie.cause, "channel_permutation");
  ASSERT_EQ(tie.candidates.size(), 2u);
  EXPECT_EQ(tie.candidates[0].probability, 0.5);
  EXPECT_EQ(std::get<std::vector<double>>(tie.candidates[1].parameters.at(0).value)[0], 4);
  ASSERT_TRUE(tie.experiment);
  EXPECT_NE(tie.experiment->find("left"), std::string::npos);
  // Where a reversed order is one of them, it stands for conjugated channels too.
  other.values.set("order", std::vector<double>{7, 6, 5, 4, 3, 2, 1, 0});
  convention.alike = {{convention.mechanism, 0.5}, {other, 0.5}};
  const Finding three = findingOf(convention, radar);
  ASSERT_EQ(three.candidates.size(), 3u);
  EXPECT_EQ(three.candidates[1].cause, "channel_conjugation");
  EXPECT_EQ(three.candidates[1].probability, 0.25);
  EXPECT_NO_THROW(toJson(three));
}

TEST(ReceiverFindings, AToneWhoseRangeIsUnknownIsEither) {
  const RadarConfig radar = paperRadar();
  const ChannelData rest = sessionOf(radar, {gridOf(radar, {{3.0, 0.1, 0.02}})}, 1e-12);
  BodyFixedTone tone;
  tone.channels = Eigen::VectorXcd::Constant(8, 0.002);
  tone.gain = 300;
  tone.range_m = 0.03;
  tone.range_error_m = 0.02;
  const Finding either = findingOf(tone, rest);
  ASSERT_EQ(either.candidates.size(), 2u);
  EXPECT_LT(either.candidates[0].probability, 0.9);
  EXPECT_EQ(either.candidates[0].cause, either.cause);
  EXPECT_TRUE(either.experiment);
  // Constants are at 0 within 1 cm, leakage anywhere up to 30 cm: an error of metres leaves both alike.
  tone.range_error_m = 10;
  EXPECT_NEAR(findingOf(tone, rest).candidates[0].probability, 0.5, 0.01);
  tone.range_error_m = 0.001;
  EXPECT_EQ(findingOf(tone, rest).cause, "tx_rx_leakage");
  EXPECT_EQ(findingOf(tone, rest).candidates.size(), 1u);
}

TEST(ReceiverFindings, ErrorsOfOneReceiversTransmittersAreThoseOfItsChannels) {
  ChannelErrors errors;
  errors.phase_rad = Eigen::VectorXd::LinSpaced(2, 0, 0.7);
  errors.gain_db = Eigen::VectorXd::Zero(2);
  errors.phase_error_rad = errors.gain_error_db = Eigen::VectorXd::Constant(2, 0.01);
  errors.groups = 5;
  errors.receivers = 1;
  errors.tie = ChannelTie::kTransmitters;
  const Finding one = findingOf(errors);
  ASSERT_EQ(one.candidates.size(), 2u);
  EXPECT_EQ(one.candidates[1].cause, "channel_phase_error");
  EXPECT_EQ(one.candidates[1].probability, 0.5);
  EXPECT_TRUE(one.experiment);
  errors.receivers = 4;
  EXPECT_EQ(findingOf(errors).candidates.size(), 1u);
}

TEST(ReceiverFindings, ErrorsOfChannelsHaveStudentsIntervals) {
  ChannelErrors errors;
  errors.phase_rad = Eigen::VectorXd::LinSpaced(8, 0, 0.7);
  errors.gain_db = Eigen::VectorXd::Constant(8, 1.5);
  errors.phase_error_rad = Eigen::VectorXd::Constant(8, 0.01);
  errors.gain_error_db = Eigen::VectorXd::Constant(8, 0.1);
  errors.groups = 5;
  errors.echoes = 30;
  errors.gain = 90;
  errors.held_out_gain = 20;
  errors.tie = ChannelTie::kTransmitters;
  const Finding tx = findingOf(errors);
  EXPECT_EQ(tx.cause, "tx_imbalance");
  EXPECT_NEAR(value(tx, "phase_deg"), 0.7 * 180 / M_PI, 1e-9);
  EXPECT_NEAR(value(tx, "gain_db"), 1.5, 1e-12);
  EXPECT_NEAR(tx.parameter("gain_db")->ci95[0][1] - 1.5, 2.776 * 0.1, 1e-3) << "Student of four";
  errors.tie = ChannelTie::kReceivers;
  const Finding receivers = findingOf(errors);
  EXPECT_EQ(receivers.cause, "channel_phase_error");
  ASSERT_EQ(receivers.parameter("phase_deg")->ci95.size(), 8u);
  EXPECT_NEAR(receivers.mechanism->values.numbers("phase_deg")[7], 0.7 * 180 / M_PI, 1e-9);
  EXPECT_NE(receivers.description, tx.description);
}

TEST(DiffersFromStated, ForTheSameThingByMoreThanItsInterval) {
  Finding f;
  f.cause = "tx_imbalance";
  f.mechanism = defaultMechanism("tx_imbalance");
  f.mechanism->values.set("phase_deg", 20.0);
  f.parameters = {{"phase_deg", "deg", 20.0, {{18.0, 22.0}}}};
  NamedParameters stated = defaultMechanism("tx_imbalance");
  EXPECT_TRUE(differsFromStated(f, {}));
  stated.values.set("phase_deg", 23.5);
  EXPECT_FALSE(differsFromStated(f, {stated})) << "within the width of its interval";
  stated.values.set("phase_deg", 24.5);
  EXPECT_TRUE(differsFromStated(f, {stated}));
  EXPECT_TRUE(differsFromStated(f, {defaultMechanism("specular")})) << "something else";
}

TEST(DiffersFromStated, ForSomeoneWhoWalksByHisPlace) {
  Finding f;
  f.cause = "moving_target";
  f.mechanism = defaultMechanism("moving_target");
  f.mechanism->values.set("x_m", 1.0);
  f.mechanism->values.set("y_m", 2.0);
  f.parameters = {{"speed_m_per_s", "m/s", 1.0, {{0.9, 1.1}}}};
  NamedParameters stated = *f.mechanism;
  stated.values.set("x_m", 1.3);
  stated.values.set("y_m", 2.3);
  EXPECT_FALSE(differsFromStated(f, {stated})) << "0.42 m away";
  stated.values.set("y_m", 2.5);
  EXPECT_TRUE(differsFromStated(f, {stated})) << "0.58 m away";
}

}  // namespace
}  // namespace mmradartwin::diagnosis
