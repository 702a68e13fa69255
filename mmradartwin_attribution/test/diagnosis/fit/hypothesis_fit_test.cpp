#include "diagnosis/fit/hypothesis_fit.h"

#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

HypothesisFit fitOf(const std::string& mechanism, const std::vector<Coordinate>& coordinates,
                    const std::vector<double>& values) {
  HypothesisFit fit;
  fit.hypothesis.mechanism.mechanism = mechanism;
  fit.hypothesis.coordinates = coordinates;
  for (std::size_t i = 0; i < values.size(); ++i) fit.scaled_values.push_back(coordinates[i].scaled(values[i]));
  fit.overwhelming = true;
  return fit;
}

TEST(HypothesisFit, FarAwayIsWhatNoErrorOfActorsLooksLike) {
  const Coordinate x{"x_m", "m", -1, 0, 0.03, -10, 10, {}}, y{"y_m", "m", -1, 0, 0.03, -10, 10, {}};
  const Coordinate yaw{"yaw_deg", "deg", -1, 0, 0.5, -180, 180, {}};
  HypothesisFit fit = fitOf("scene_registration", {x, y, yaw}, {0.13, -0.10, 1.6});
  EXPECT_NEAR(fit.moved_m(), std::hypot(0.13, 0.10), 1e-12);
  EXPECT_TRUE(fit.isFarAway());
  fit.overwhelming = false;
  fit.gain_without_best_place = 100;
  EXPECT_TRUE(fit.isFarAway());
  fit.overdispersion = 2;
  EXPECT_FALSE(fit.isFarAway()) << "places scatter by as much as it gains";
  EXPECT_FALSE(fitOf("scene_registration", {x, y, yaw}, {0.05, -0.04, 1.6}).isFarAway());
  EXPECT_EQ(fitOf("radar_yaw_offset", {yaw}, {20}).moved_m(), 0);
  // A twin that states 20 cm, of which 21 are true.
  Coordinate stated = x;
  stated.parameter = "range_m";
  stated.neutral = 0.20;
  stated.typical = 0.23;
  EXPECT_FALSE(fitOf("range_bias", {stated}, {0.21}).isFarAway());
  EXPECT_TRUE(fitOf("range_bias", {stated}, {0.35}).isFarAway());
}

TEST(HypothesisFit, AMoveBelowWhatScenesAreWrongByCostsMore) {
  const Coordinate dx{"dx_m", "m", -1, 0, 0.05, -3, 3, {}}, dy{"dy_m", "m", -1, 0, 0.05, -3, 3, {}};
  const auto moveOf = [&](double dx_m) {
    HypothesisFit fit = fitOf("actor_moved", {dx, dy}, {dx_m, 0});
    fit.hypothesis.mechanism = defaultMechanism("actor_moved");
    fit.gain = 50;
    return fit;
  };
  EXPECT_NEAR(moveOf(0.2).moved_m(), 0.2, 1e-9);
  EXPECT_DOUBLE_EQ(moveOf(0.2).ranking(), 50 - 2 * 5);
  EXPECT_DOUBLE_EQ(moveOf(0.03).ranking(), 50 - 3 * 5);
}

TEST(HypothesisFit, WhatBendsToMuchRanksByPartOfItsGain) {
  HypothesisFit law;
  law.hypothesis.mechanism = defaultMechanism("empirical_law");
  law.hypothesis.coordinates.resize(4);
  law.hypothesis.searched = 2;
  law.gain = 90;
  EXPECT_EQ(law.numbers(), 6U);
  EXPECT_NEAR(law.ranking(), 60 - 30, 1e-9);
  HypothesisFit presence;
  presence.hypothesis.mechanism = defaultMechanism("actor_absent");
  presence.gain = 40;
  EXPECT_EQ(presence.numbers(), 1U);
  EXPECT_NEAR(presence.ranking(), 35, 1e-9);
}

/// A room with a known effect, fitted.
class FittedEffect : public ::testing::Test {
 protected:
  void measure(const std::vector<NamedParameters>& more) {
    std::vector<NamedParameters> truth = firstOrder();
    truth.insert(truth.end(), more.begin(), more.end());
    room_.measure(truth);
    fitted_.emplace(room_, firstOrder());
  }
  HypothesisFit fit(const Hypothesis& hypothesis, double start) {
    return fitted_->fitter.fit(fitted_->null, hypothesis, {std::vector<double>(hypothesis.coordinates.size(), start)});
  }

  MadeRoom room_{10};
  std::optional<FittedRoom> fitted_;
  const Hypothesis drift_ = hypothesisOf("gain_drift", {{"db_per_hour", "dB/h", -1, 0, 5, -1000, 1000, {}}});
  const Hypothesis yaw_ = hypothesisOf("radar_yaw_offset", {{"yaw_deg", "deg", -1, 0, 0.5, -180, 180, {}}});
};

TEST_F(FittedEffect, ATurnOfTheRadarIsFittedToItsValue) {
  measure({mechanismWith("radar_yaw_offset", {{"yaw_deg", 2.0}})});
  const HypothesisFit f = fit(yaw_, 3);
  EXPECT_NEAR(0.5 * f.scaled_values[0], 2, 0.4);
  EXPECT_GT(f.gain, 20);
}

TEST_F(FittedEffect, NothingIsGainedWhereNothingIsWrong) {
  measure({});
  EXPECT_LT(fit(drift_, 1).gain, 4);
  EXPECT_LT(fit(reflectivityOf("Plate"), 1).gain, 4);
}

TEST_F(FittedEffect, SeveralAreFittedTogether) {
  measure(
      {mechanismWith("gain_drift", {{"db_per_hour", 80.0}}), mechanismWith("radar_yaw_offset", {{"yaw_deg", 2.0}})});
  const JointFit joint = fitted_->fitter.refit(firstOrder(), fitted_->null.latents, {drift_, yaw_}, {{8.0}, {3.0}});
  ASSERT_EQ(joint.scaled_values.size(), 2U);
  EXPECT_NEAR(5 * joint.scaled_values[0][0], 80, 3 * joint.standard_error[0][0]);
  EXPECT_NEAR(0.5 * joint.scaled_values[1][0], 2, 0.4);
  EXPECT_GT(joint.evidence[0].scattered(), 0);
  EXPECT_GT(joint.evidence[1].nats, 10);
}

TEST_F(FittedEffect, FalseAlarmsOfAFamilyFollowChance) {
  measure({});
  // At very many places the distribution of twice the gain is chi squared; at few the rate is higher.
  const double gain = 6;
  const double by_chance = boost::math::cdf(boost::math::complement(boost::math::chi_squared(1), 2 * gain));
  const double rate = fitted_->fitter.falseAlarmRate(gain, drift_, 1, 1);
  EXPECT_GT(rate, by_chance);
  EXPECT_LT(rate, 100 * by_chance);
  EXPECT_NEAR(fitted_->fitter.falseAlarmRate(gain, drift_, 1, 10), 10 * rate, 1e-9);
  EXPECT_EQ(fitted_->fitter.falseAlarmRate(0, drift_, 1, 50), 1);
  EXPECT_LT(fitted_->fitter.falseAlarmRate(gain + 3, drift_, 1, 1), rate);
}

TEST_F(FittedEffect, IsOverwhelmingWhereItGainsFiveNatsAPose) {
  measure({});
  EXPECT_FALSE(fitted_->fitter.isOverwhelming(50));
  EXPECT_TRUE(fitted_->fitter.isOverwhelming(50.1));
  HypothesisFit f = fit(drift_, 1);
  f.gain_without_best_place = 51;
  f.overdispersion = 49;
  fitted_->fitter.judge(f, 300);
  EXPECT_TRUE(f.overwhelming);
  EXPECT_LE(f.false_alarm_rate, 0.01);
}

TEST_F(FittedEffect, LatentsThatAreNoBetterAreNotTakenOver) {
  measure({});
  EXPECT_FALSE(fitted_->fitter.improved(fitted_->null, fitted_->null.latents).has_value());
}

}  // namespace
}  // namespace mmradartwin::diagnosis
