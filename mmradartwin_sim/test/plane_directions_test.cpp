// Pieces of walls that a drifting scanner bends: which of them become one plane. Pieces are sampled here.

#include "scan/planes/plane_directions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace mmradartwin {
namespace {

constexpr double kDeg = M_PI / 180;
constexpr double kNoise_m = 0.004;
constexpr double kLong_m = 4, kHigh_m = 2.5;  // of a piece

/// Pieces of walls that face along +y, each with an end at a place and turned by an angle about the vertical.
class Pieces {
 public:
  Pieces() {
    samples.oriented = true;
    samples.spacing_m = 0.05;
    samples.noise_m = kNoise_m;
    samples.dense_first = {0};
  }

  void add(double x_m, double y_m, double turned_deg, double long_m = kLong_m) {
    const double a = turned_deg * kDeg;
    const Eigen::Vector3d along(std::cos(a), std::sin(a), 0), end(x_m, y_m, 0);
    PlaneRegion r;
    r.normal = {-std::sin(a), std::cos(a), 0};
    r.offset_m = r.normal.dot(end);
    r.middle = end + long_m / 2 * along + kHigh_m / 2 * Eigen::Vector3d::UnitZ();
    r.area_m2 = long_m * kHigh_m;
    r.rms_m = kNoise_m;
    r.offset_std_m = 0.001;
    r.angle_std_rad = 0.02 * kDeg;
    for (double s = 0.025; s < long_m; s += samples.spacing_m) {
      for (double z = 0.025; z < kHigh_m; z += samples.spacing_m) {
        const Eigen::Vector3d p = end + s * along + z * Eigen::Vector3d::UnitZ() + noise_(random_) * r.normal;
        r.samples.push_back(static_cast<int>(samples.points.size()));
        samples.points.push_back(p.cast<float>());
        samples.normals.push_back(r.normal.cast<float>());
        samples.dense.push_back(p.cast<float>());
        samples.dense_first.push_back(samples.dense.size());
      }
    }
    regions.push_back(r);
  }
  double step_m(double turned_deg) const { return kLong_m * std::sin(turned_deg * kDeg); }

  ScanSamples samples;
  std::vector<PlaneRegion> regions;

 private:
  std::mt19937 random_{11};
  std::normal_distribution<double> noise_{0, kNoise_m};
};

TEST(PlaneDirectionsTest, PiecesOfABentWallAreOnePlane) {
  Pieces wall;  // a shallow V: 4.2 mm deep at its joint
  wall.add(0, 0, -0.06);
  wall.add(kLong_m, wall.step_m(-0.06), 0.06);
  const std::size_t all = wall.samples.size();
  regularise(wall.samples, true, wall.regions);
  ASSERT_EQ(wall.regions.size(), 1U);
  const PlaneRegion& joined = wall.regions.front();
  EXPECT_EQ(joined.samples.size(), all);
  EXPECT_GT(joined.normal.y(), std::cos(0.02 * kDeg));
  EXPECT_NEAR(joined.offset_m, wall.step_m(-0.06) / 2, 0.001);  // half way between ends and joint
  EXPECT_NEAR(joined.rms_m, std::hypot(kNoise_m, wall.step_m(0.06) / std::sqrt(12.0)), 0.0003);  // noise and bend
}

TEST(PlaneDirectionsTest, CopiesOfAWallSayHowFarFramesAreTurned) {
  Pieces doubled;  // two frames see a wall, one of them turned by 0.3 degrees; another wall stands at a right angle
  doubled.add(0, 0, 0);
  doubled.add(0, 0.02, 0.3, 3);
  doubled.add(kLong_m, 0, 90);
  regularise(doubled.samples, true, doubled.regions);
  ASSERT_EQ(doubled.regions.size(), 3U);
  EXPECT_GT(doubled.regions[0].normal.dot(doubled.regions[1].normal), 1 - 1e-12);  // three times 0.3 / sqrt(2)
  Pieces skewed;                                                                   // as far turned, and no copy
  skewed.add(0, 0, 0);
  skewed.add(0, 3, 0.3, 3);
  skewed.add(kLong_m, 0, 90);
  regularise(skewed.samples, true, skewed.regions);
  EXPECT_LT(skewed.regions[0].normal.dot(skewed.regions[1].normal), std::cos(0.2 * kDeg));
}

TEST(PlaneDirectionsTest, PiecesThatNoOnePlaneHoldsStayApart) {
  Pieces corner;  // 3 degrees: joined, a tenth of the samples and more would lie off
  corner.add(0, 0, -1.5);
  corner.add(kLong_m, corner.step_m(-1.5), 1.5);
  regularise(corner.samples, true, corner.regions);
  EXPECT_EQ(corner.regions.size(), 2U);
}

TEST(PlaneDirectionsTest, WhatStandsBeforeAWallIsNoPieceOfIt) {
  Pieces door;  // a leaf before the wall's own samples, nearer than the tolerance
  door.add(0, 0, 0);
  door.add(1, 0.006, 0, 0.9);
  regularise(door.samples, true, door.regions);
  EXPECT_EQ(door.regions.size(), 2U);
}

TEST(PlaneDirectionsTest, PiecesFarApartStayApart) {
  for (const double gap_m : {0.4, 0.8}) {  // a cabinet hides as much of a wall, or a passage parts it
    Pieces wall;
    wall.add(0, 0, 0);
    wall.add(kLong_m + gap_m, 0, 0, 2);
    regularise(wall.samples, true, wall.regions);
    EXPECT_EQ(wall.regions.size(), gap_m < 0.6 ? 1U : 2U) << gap_m;
  }
}

}  // namespace
}  // namespace mmradartwin
