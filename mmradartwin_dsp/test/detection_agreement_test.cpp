#include "mmradartwin_dsp/detection_agreement.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mmradartwin {
namespace {

Detection at(double x_m, double y_m) {
  Detection detection;
  detection.range_m = std::hypot(x_m, y_m);
  detection.azimuth_rad = std::atan2(y_m, x_m);
  return detection;
}

TEST(DetectionAgreement, PositiveAzimuthIsLeft) {
  EXPECT_LT((position_m(at(3, 4)) - Eigen::Vector2d(3, 4)).norm(), 1e-12);
}

TEST(DetectionAgreement, EqualSetsAgree) {
  const std::vector<Detection> some = {at(1, 0), at(2, 1), at(5, -2)};
  const DetectionAgreement same = agreement(some, some, 0.3);
  EXPECT_EQ(same.matched, 3);
  EXPECT_EQ(same.precision, 1);
  EXPECT_EQ(same.recall, 1);
  EXPECT_EQ(same.chamfer_m, 0);
}

TEST(DetectionAgreement, SharesAndDistancesFollowTheirFormulas) {
  // Measured: one is met at 0.1 m, one is missed by 1 m. Simulated: one more, 2 m beyond the first.
  const DetectionAgreement found = agreement({at(2, 0), at(4, 0)}, {at(2.1, 0), at(3, 0), at(0, 0)}, 0.3);
  EXPECT_EQ(found.measured, 2);
  EXPECT_EQ(found.simulated, 3);
  EXPECT_EQ(found.matched, 1);
  EXPECT_DOUBLE_EQ(found.precision, 1.0 / 3);
  EXPECT_DOUBLE_EQ(found.recall, 1.0 / 2);
  EXPECT_NEAR(found.chamfer_m, ((0.1 + 1) / 2 + (0.1 + 1 + 2) / 3) / 2, 1e-12);
}

TEST(DetectionAgreement, OneMatchesOneAndTheNearestFirst) {
  // Two simulated detections beside one measured: the nearer one is its match, whichever comes first.
  EXPECT_EQ(agreement({at(2, 0)}, {at(2.2, 0), at(2.1, 0)}, 0.3).matched, 1);
  // The nearer pair is taken, and the other two of the four are still a pair.
  EXPECT_EQ(agreement({at(2, 0), at(2.2, 0)}, {at(2.15, 0), at(2.4, 0)}, 0.25).matched, 1);
  EXPECT_EQ(agreement({at(2, 0), at(2.2, 0)}, {at(2.15, 0), at(2.4, 0)}, 0.4).matched, 2);
}

TEST(DetectionAgreement, TheRadiusItselfStillMatches) {
  EXPECT_EQ(agreement({at(1, 0)}, {at(1.5, 0)}, 0.5).matched, 1);
  EXPECT_EQ(agreement({at(1, 0)}, {at(1.5, 0)}, 0.499).matched, 0);
}

TEST(DetectionAgreement, WhatIsDividedByAnEmptySetIsNoNumber) {
  const DetectionAgreement no_twin = agreement({at(1, 0)}, {}, 0.3);
  EXPECT_TRUE(std::isnan(no_twin.precision));
  EXPECT_EQ(no_twin.recall, 0);
  EXPECT_TRUE(std::isnan(no_twin.chamfer_m));
  const DetectionAgreement no_radar = agreement({}, {at(1, 0)}, 0.3);
  EXPECT_EQ(no_radar.precision, 0);
  EXPECT_TRUE(std::isnan(no_radar.recall));
}

}  // namespace
}  // namespace mmradartwin
