#include "diagnosis/rounds/hypothesis_finding.h"

#include <gtest/gtest.h>

#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis {
namespace {

HypothesisFit fitOf(const std::string& mechanism, double gain, const std::string& subject = "") {
  HypothesisFit fit;
  fit.hypothesis.mechanism = defaultMechanism(mechanism);
  fit.hypothesis.subject = subject;
  fit.gain = gain;
  return fit;
}
HypothesisFit with(HypothesisFit fit, const std::string& parameter, double value) {
  fit.hypothesis.mechanism.values.set(parameter, value);
  return fit;
}
HypothesisFit objectAt(double x_m, double y_m, double size_m) {
  return with(with(with(fitOf("actor_unmodelled", 100), "x_m", x_m), "y_m", y_m), "size_m", size_m);
}
FrameFinding walkerAt(double x_m, double y_m) {
  FrameFinding walker;
  walker.cause = "moving_target";
  walker.where.emplace_back();
  walker.where.back().x_m = x_m;
  walker.where.back().y_m = y_m;
  return walker;
}

Finding findingOfFits(const std::vector<HypothesisFit>& fits) {
  return findingOf(fits.front(), fits, ModelState(), Scene(), ChannelData());
}

TEST(Candidates, EqualEvidenceIsNoCertainty) {
  const Finding two = findingOfFits({fitOf("gain_drift", 100), fitOf("range_bias", 100)});
  ASSERT_EQ(two.candidates.size(), 2u);
  EXPECT_EQ(two.candidates[0].probability, 0.5);
  EXPECT_EQ(two.candidates[1].cause, "range_bias");
  EXPECT_TRUE(two.experiment);
  EXPECT_TRUE(two.candidates[0].parameters.empty()) << "their names tell them apart";
  EXPECT_EQ(findingOfFits({fitOf("gain_drift", 100), fitOf("range_bias", 90)}).candidates.size(), 1u);
}

TEST(Candidates, NorIsItOfOneCauseAboutTwoThings) {
  const auto absent = [](const std::string& actor, double gain) {
    HypothesisFit fit = fitOf("actor_absent", gain, actor);
    fit.hypothesis.mechanism.values.set("actor", actor);
    return fit;
  };
  const Finding tie = findingOfFits({absent("chair", 100), absent("table", 100 - 5e-11)});
  ASSERT_EQ(tie.candidates.size(), 2u);
  EXPECT_NEAR(tie.candidates[0].probability, 0.5, 1e-9);
  ASSERT_EQ(tie.candidates[1].parameters.size(), 1u);
  EXPECT_EQ(std::get<std::string>(tie.candidates[1].parameters[0].value), "table");
  EXPECT_TRUE(tie.experiment);
  EXPECT_EQ(findingOfFits({absent("chair", 100), absent("table", 98)}).candidates.size(), 1u) << "told apart";
}

TEST(RejectionReason, NamesValuesThatNoSurfaceHas) {
  EXPECT_NE(rejectionReason(with(fitOf("diffuse_scattering", 9), "scattering_coefficient", 0.05), {}), "");
  EXPECT_EQ(rejectionReason(with(fitOf("diffuse_scattering", 9), "scattering_coefficient", 0.5), {}), "");
  EXPECT_NE(rejectionReason(with(fitOf("diffuse_scattering", 9), "scattering_coefficient", 0.99), {}), "");
  const std::string reason = rejectionReason(with(fitOf("transmission", 9), "one_way_db", -0.1), {});
  EXPECT_NE(reason.find("-0.1 dB"), std::string::npos) << reason;
  EXPECT_EQ(rejectionReason(with(fitOf("transmission", 9), "one_way_db", -6.0), {}), "");
  EXPECT_EQ(rejectionReason(fitOf("range_bias", 9), {}), "") << "no such range";
  // From wood to metal is 15.4 dB.
  EXPECT_NE(rejectionReason(with(fitOf("material_reflectivity", 100), "delta_db", 27), {}), "");
  EXPECT_EQ(rejectionReason(with(fitOf("material_reflectivity", 100), "delta_db", 15), {}), "");
}

TEST(RejectionReason, AnObjectIsNoneWhereItIsTinyOrSomeoneWalks) {
  EXPECT_NE(rejectionReason(objectAt(2, 1, 0.04), {}), "");
  EXPECT_EQ(rejectionReason(objectAt(2, 1, 0.25), {}), "");
  EXPECT_NE(rejectionReason(objectAt(2, 1, 0.25), {walkerAt(2.2, 1.2)}), "");
  EXPECT_EQ(rejectionReason(objectAt(2, 1, 0.25), {walkerAt(4, 1)}), "") << "far from the walk";
  EXPECT_EQ(rejectionReason(objectAt(2, 1, 1.2), {walkerAt(2.2, 1.2)}), "") << "larger than a person";
}

TEST(LikeClutter, IsBelievedByWhatTheMapsExplain) {
  EXPECT_TRUE(isLikeClutter(objectAt(2, 1, 0.5), false, false));
  EXPECT_FALSE(isLikeClutter(objectAt(2, 1, 0.5), true, false));
  EXPECT_TRUE(isLikeClutter(objectAt(2, 1, 0.08), true, false)) << "small things lie about";
  EXPECT_FALSE(isLikeClutter(objectAt(2, 1, 0.08), true, true));
  EXPECT_TRUE(isLikeClutter(fitOf("transmission", 9), true, false));
  HypothesisFit overwhelming = fitOf("transmission", 9);
  overwhelming.overwhelming = true;
  EXPECT_FALSE(isLikeClutter(overwhelming, true, false));
  EXPECT_FALSE(isLikeClutter(fitOf("range_bias", 9), false, false)) << "clutter has no range bias";
}

TEST(LikeClutter, AReplicaOfOneActorIsUnlessItIsLoud) {
  const HypothesisFit weak = with(fitOf("echo_replica", 9, "wall"), "level_db", -20.0);
  const HypothesisFit loud = with(fitOf("echo_replica", 9, "wall"), "level_db", -5.0);
  EXPECT_TRUE(isLikeClutter(weak, false, false));
  EXPECT_FALSE(isLikeClutter(loud, false, false));
  EXPECT_FALSE(isLikeClutter(with(fitOf("echo_replica", 9), "level_db", -20.0), false, false)) << "of all echoes";
}

TEST(Preference, AnAbsenceIsAsSureAsTheMoveOfTheSameActor) {
  std::vector<HypothesisFit> fits = {fitOf("actor_absent", 90, "chair"), fitOf("actor_moved", 90, "chair"),
                                     fitOf("actor_moved", 90, "table")};
  fits[0].false_alarm_rate = 0.5;
  fits[1].false_alarm_rate = 1e-6;
  fits[2].false_alarm_rate = 1e-9;
  preferAbsences(fits);
  EXPECT_EQ(fits[0].false_alarm_rate, 1e-6);
}

TEST(Preference, ABetterNameIsAsSureAsOneThatExplainsTheSamePoses) {
  ModelState before;
  before.by_pose = {0, 0, 0, 0};
  std::vector<HypothesisFit> fits = {fitOf("excess_attenuation", 100), fitOf("if_highpass", 80),
                                     fitOf("gain_drift", 70)};
  fits[0].state.by_pose = {1, 2, 3, 4};
  fits[1].state.by_pose = {2, 4, 6, 8.5};
  fits[2].state.by_pose = {4, 3, 2, 1};
  fits[0].false_alarm_rate = 0.3;
  fits[1].false_alarm_rate = 1e-3;
  fits[2].false_alarm_rate = 1e-9;
  preferBetterNames(fits, before);
  EXPECT_EQ(fits[0].false_alarm_rate, 1e-3) << "not from the one that gains at other poses";
}

TEST(Preference, ASimplerGeometryComesFirstWherePlacesDoNotTellItApart) {
  ChannelData data;
  for (int i = 0; i < 4; ++i) {
    data.locations.push_back(std::to_string(i));
    data.poses.emplace_back().location = i;
  }
  const auto firstOf = [&](const std::vector<double>& shift_by_pose) {
    std::vector<HypothesisFit> fits = {fitOf("scene_registration", 440), fitOf("range_bias", 400)};
    const Coordinate metres{"range_m", "m", -1, 0, 0.03, -1, 1, {}};
    fits[0].hypothesis.coordinates.assign(3, metres);
    fits[1].hypothesis.coordinates.assign(1, metres);
    fits[0].state.by_pose = shift_by_pose;
    fits[1].state.by_pose = {100, 100, 100, 100};
    fits[0].state.log_likelihood = 440;
    fits[1].state.log_likelihood = 400;
    preferSimplerGeometry(fits, data);
    return fits[0].hypothesis.mechanism.mechanism;
  };
  EXPECT_EQ(firstOf({180, 60, 160, 40}), "range_bias") << "40 nats, scattered by 140";
  EXPECT_EQ(firstOf({110, 111, 109, 110}), "scene_registration") << "40 nats, alike at all places";
}

TEST(Preference, ASimplerNameComesFirstWherePlacesDoNotTellItApart) {
  ChannelData data;
  for (int i = 0; i < 4; ++i) {
    data.locations.push_back(std::to_string(i));
    data.poses.emplace_back().location = i;
  }
  ModelState before;
  before.by_pose = {0, 0, 0, 0};
  const auto firstOf = [&](const std::vector<double>& by_pose, const std::vector<double>& simpler_by_pose) {
    std::vector<HypothesisFit> fits = {fitOf("wall_ghost", 0, "wall"), fitOf("corner_reflection", 0, "wall;cabinet")};
    fits[0].hypothesis.coordinates.assign(2, Coordinate{"gain_db", "dB", -1, 0, 1, -60, 0, {}});
    fits[0].state.by_pose = by_pose;
    fits[1].state.by_pose = simpler_by_pose;
    for (HypothesisFit& f : fits) {
      for (double nats : f.state.by_pose) f.gain += nats;
      f.state.log_likelihood = f.gain;
      f.false_alarm_rate = 1e-4;
    }
    preferSimplerNames(fits, before, data);
    return fits[0].hypothesis.mechanism.mechanism;
  };
  EXPECT_EQ(firstOf({90, 20, 40, 10}, {75, 25, 25, 15}), "corner_reflection") << "20 nats, scattered by 11";
  EXPECT_EQ(firstOf({95, 25, 40, 20}, {88, 19, 32, 13}), "wall_ghost") << "28 nats, alike at all places";
  EXPECT_EQ(firstOf({90, 20, 40, 10}, {15, 75, 25, 25}), "wall_ghost") << "other poses";
  EXPECT_EQ(firstOf({90, 20, 40, 10}, {60, 25, 15, 5}), "wall_ghost") << "far less";
}

TEST(GainByPose, IsTheDifferenceAndItsCorrelationPearsons) {
  ModelState before;
  before.by_pose = {1, 1, 1};
  HypothesisFit fit;
  fit.state.by_pose = {2, 1, 4};
  const Eigen::VectorXd gain = gainByPose(fit, before);
  EXPECT_EQ(gain, Eigen::Vector3d(1, 0, 3));
  EXPECT_NEAR(correlation(gain, 2 * gain.array() + 7), 1, 1e-12);
  EXPECT_NEAR(correlation(gain, -gain), -1, 1e-12);
  EXPECT_NEAR(correlation(Eigen::Vector3d(1, 0, -1), Eigen::Vector3d(1, -2, 1)), 0, 1e-12);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
