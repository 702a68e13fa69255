#include "diagnosis/fit/hypothesis_fit.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mmradartwin::diagnosis {
namespace {

HypothesisFit fitOf(const std::string& mechanism, const std::vector<Coordinate>& coordinates,
                    const std::vector<double>& values) {
  HypothesisFit fit;
  fit.hypothesis.mechanism.mechanism = mechanism;
  fit.hypothesis.coordinates = coordinates;
  for (std::size_t i = 0; i < values.size(); ++i) fit.scaled_values.push_back(coordinates[i].scaled(values[i]));
  fit.plain = true;
  return fit;
}

TEST(HypothesisFit, FarAwayIsWhatNoErrorOfActorsLooksLike) {
  const Coordinate x{"x_m", "m", -1, 0, 0.03, -10, 10, {}}, y{"y_m", "m", -1, 0, 0.03, -10, 10, {}};
  const Coordinate yaw{"yaw_deg", "deg", -1, 0, 0.5, -180, 180, {}};
  HypothesisFit fit = fitOf("scene_registration", {x, y, yaw}, {0.13, -0.10, 1.6});
  EXPECT_NEAR(fit.moved_m(), std::hypot(0.13, 0.10), 1e-12);
  EXPECT_TRUE(fit.isFarAway());
  fit.plain = false;
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

}  // namespace
}  // namespace mmradartwin::diagnosis
