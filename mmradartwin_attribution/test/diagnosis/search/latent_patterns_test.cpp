#include "diagnosis/search/latent_patterns.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

/// A law of one observable as a table over a variable, each of whose points is a number.
Screened lawOver(const std::string& variable, const std::string& parameter, const std::string& unit,
                 const std::vector<double>& at, const std::vector<double>& values) {
  Screened law;
  Hypothesis& h = law.hypothesis;
  h.mechanism = defaultMechanism("empirical_law");
  h.mechanism.values.set("variable", variable);
  h.mechanism.values.set("at", at);
  h.mechanism.values.set(parameter, std::vector<double>(at.size(), 0.0));
  law.starts = {{}};
  for (std::size_t i = 0; i < at.size(); ++i) {
    h.coordinates.push_back({parameter, unit, static_cast<int>(i), 0, 1, -100, 100, {}});
    law.starts[0].push_back(values[i]);
  }
  law.screened_nats = 33;
  return law;
}

const std::vector<Hypothesis>& named() {
  static const std::vector<Hypothesis> kAll = {
      hypothesisOf("radar_position_offset",
                   {{"forward_m", "m", -1, 0, 0.03, -10, 10, {}}, {"left_m", "m", -1, 0, 0.03, -10, 10, {}}}),
      hypothesisOf("scene_registration", {{"x_m", "m", -1, 0, 0.03, -100, 100, {}},
                                          {"y_m", "m", -1, 0, 0.03, -100, 100, {}},
                                          {"yaw_deg", "deg", -1, 0, 0.5, -180, 180, {}}}),
      hypothesisOf("excess_attenuation", {{"db_per_m", "dB/m", -1, 0, 0.5, -20, 20, {}}}),
      hypothesisOf("gain_drift", {{"db_per_hour", "dB/h", -1, 0, 5, -1000, 1000, {}}})};
  return kAll;
}

std::vector<double> angles() {
  std::vector<double> at;
  for (int i = 0; i <= 12; ++i) at.push_back(-60 + 10 * i);
  return at;
}

TEST(NamedLike, DelaysOverAzimuthAreAnOffsetOfTheRadar) {
  const double forward_m = 0.05, left_m = -0.02;
  std::vector<double> delays_m;
  for (double a : angles()) {
    delays_m.push_back(-(forward_m * std::cos(a * M_PI / 180) + left_m * std::sin(a * M_PI / 180)));
  }
  const auto like = namedLike(lawOver("azimuth_deg", "delay_m", "m", angles(), delays_m), named());
  ASSERT_TRUE(like.has_value());
  EXPECT_EQ(like->screened_nats, 33);
  const NamedParameters start = like->hypothesis.at(like->starts[0]);
  EXPECT_EQ(start.mechanism, "radar_position_offset");
  EXPECT_NEAR(start.values.number("forward_m"), forward_m, 1e-3);
  EXPECT_NEAR(start.values.number("left_m"), left_m, 1e-3);
}

TEST(NamedLike, DelaysOverBearingAreAnOffsetOfTheScene) {
  std::vector<double> delays_m;
  for (double a : angles()) delays_m.push_back(0.03 * std::cos(a * M_PI / 180) + 0.04 * std::sin(a * M_PI / 180));
  const auto like = namedLike(lawOver("bearing_deg", "delay_m", "m", angles(), delays_m), named());
  ASSERT_TRUE(like.has_value());
  const NamedParameters start = like->hypothesis.at(like->starts[0]);
  EXPECT_EQ(start.mechanism, "scene_registration");
  EXPECT_NEAR(start.values.number("x_m"), 0.03, 1e-3);
  EXPECT_NEAR(start.values.number("y_m"), 0.04, 1e-3);
  EXPECT_EQ(start.values.number("yaw_deg"), 0);
}

TEST(NamedLike, LevelsOverRangeAndTimeAreAttenuationAndDrift) {
  const auto attenuation = namedLike(lawOver("range_m", "gain_db", "dB", {1, 3, 6}, {2, 1, -1}), named());
  ASSERT_TRUE(attenuation.has_value());
  EXPECT_NEAR(attenuation->hypothesis.at(attenuation->starts[0]).values.number("db_per_m"), 0.6, 1e-9);
  const auto drift = namedLike(lawOver("time_s", "gain_db", "dB", {0, 1800}, {0, -2}), named());
  ASSERT_TRUE(drift.has_value());
  EXPECT_NEAR(drift->hypothesis.at(drift->starts[0]).values.number("db_per_hour"), -4, 1e-9);
}

TEST(NamedLike, OtherLawsHaveNoName) {
  EXPECT_FALSE(namedLike(lawOver("height_m", "gain_db", "dB", {0, 1}, {0, 3}), named()).has_value());
  EXPECT_FALSE(namedLike(lawOver("range_m", "delay_m", "m", {0, 1}, {0, 0.1}), named()).has_value());
  // 60 dB/m is beyond what an attenuation may be.
  EXPECT_FALSE(namedLike(lawOver("range_m", "gain_db", "dB", {1, 2}, {0, -60}), named()).has_value());
  Screened of_actor = lawOver("range_m", "gain_db", "dB", {1, 3}, {2, 1});
  of_actor.hypothesis.mechanism.values.set("actor", std::string("east"));
  EXPECT_FALSE(namedLike(of_actor, named()).has_value());
}

class SharedLatents : public ::testing::Test {
 protected:
  void SetUp() override {
    room_.measure(firstOrder());
    fitted_.emplace(room_, firstOrder());
    SessionLatents& latents = fitted_->null.latents;
    std::fill(latents.actor_gain.begin(), latents.actor_gain.end(), 0.0);
    std::fill(latents.actor_range_m.begin(), latents.actor_range_m.end(), 0.0);
    std::fill(latents.yaw_rad.begin(), latents.yaw_rad.end(), 0.0);
  }
  std::vector<Screened> shared(const std::vector<Hypothesis>& all) {
    return sharedLatents(fitted_->source, fitted_->null, fitted_->model.spread(), PoseAccuracy(), all,
                         fitted_->everyPose());
  }

  MadeRoom room_{8};
  std::optional<FittedRoom> fitted_;
};

TEST_F(SharedLatents, LevelsOfOneMaterialsActorsAreItsReflectivity) {
  const double delta_db = -5;
  for (int actor : {0, 2})
    fitted_->null.latents.actor_gain[static_cast<std::size_t>(actor)] = delta_db / (10 / std::log(10.0));
  const std::vector<Screened> found = shared({reflectivityOf("Metal"), reflectivityOf("Plate")});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].hypothesis.subject, "Metal");
  EXPECT_NEAR(found[0].hypothesis.at(found[0].starts[0]).values.number("delta_db"), delta_db, 1e-9);
  // Two errors of -5 dB of 1.5 dB each.
  EXPECT_NEAR(found[0].screened_nats, std::pow(5 / 1.5, 2), 0.01);
}

TEST_F(SharedLatents, LevelsWithinTheirErrorsPointAtNothing) {
  fitted_->null.latents.actor_gain[0] = -3 / 4.343;  // two standard deviations
  EXPECT_TRUE(shared({reflectivityOf("Metal")}).empty());
}

TEST_F(SharedLatents, RangesThatAllActorsShareAreABiasOfRanges) {
  const double bias_m = 0.045;
  for (int actor : {0, 1, 2}) fitted_->null.latents.actor_range_m[static_cast<std::size_t>(actor)] = bias_m;
  const Hypothesis range_bias = hypothesisOf("range_bias", {{"range_m", "m", -1, 0, 0.02, -5, 5, {}}});
  const std::vector<Screened> found = shared({range_bias});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].hypothesis.at(found[0].starts[0]).values.number("range_m"), bias_m, 1e-3);
  EXPECT_NEAR(found[0].screened_nats, 0.5 * 3 * std::pow(bias_m / 0.02, 2), 0.1);
}

TEST_F(SharedLatents, HeadingsThatAllPosesShareAreATurnOfTheRadar) {
  const double turned_deg = 2;
  std::fill(fitted_->null.latents.yaw_rad.begin(), fitted_->null.latents.yaw_rad.end(), turned_deg * M_PI / 180);
  const Hypothesis yaw = hypothesisOf("radar_yaw_offset", {{"yaw_deg", "deg", -1, 0, 0.5, -180, 180, {}}});
  const std::vector<Screened> found = shared({yaw});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].hypothesis.at(found[0].starts[0]).values.number("yaw_deg"), turned_deg, 0.05);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
