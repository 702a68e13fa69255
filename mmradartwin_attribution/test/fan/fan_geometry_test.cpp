#include "fan_geometry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr int kRanges = 40, kAngles = 64;
constexpr double kBin_m = 0.15;

// Uniform in the sine, as an array of half wavelengths sees it.
FanGeometry paperFan() {
  std::vector<double> range, azimuth;
  for (int r = 0; r < kRanges; ++r) range.push_back(r * kBin_m);
  for (int a = 0; a < kAngles; ++a) azimuth.push_back(std::asin((a - 32) / 32.0));
  return {range, azimuth};
}

double area_m2(const FanPoint& a, const FanPoint& b, const FanPoint& c) {
  return 0.5 * ((b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m));
}

TEST(FanGeometry, CornersAreHalfABinFromTheCentreInRangeAndSine) {
  const FanGeometry fan = paperFan();
  for (int a : {1, 20, 32, 50, 63}) {
    const auto corners = fan.corners(7, static_cast<std::size_t>(a));
    const double right = std::asin((a - 32.5) / 32), left = std::asin(std::min(1.0, (a - 31.5) / 32));
    const double near_m = 6.5 * kBin_m, far_m = 7.5 * kBin_m;
    EXPECT_NEAR(corners[0].x_m, near_m * std::cos(right), 1e-12);
    EXPECT_NEAR(corners[0].y_m, near_m * std::sin(right), 1e-12);
    EXPECT_NEAR(corners[1].x_m, far_m * std::cos(right), 1e-12);
    EXPECT_NEAR(corners[2].y_m, far_m * std::sin(left), 1e-12);
    EXPECT_NEAR(corners[3].x_m, near_m * std::cos(left), 1e-12);
  }
  EXPECT_EQ(fan.rangeEdges_m().front(), 0);  // the first bin's centre is the radar
  EXPECT_NEAR(fan.farthest_m(), (kRanges - 0.5) * kBin_m, 1e-12);
}

TEST(FanGeometry, EveryPlaceIsInTheCellWhoseEdgesEncloseIt) {
  const FanGeometry fan = paperFan();
  for (int r = 0; r < kRanges; ++r) {
    for (int a = 0; a < kAngles; ++a) {
      const double range = r == 0 ? 0.25 * kBin_m : r * kBin_m;
      for (double part : {-0.49, 0.0, 0.49}) {
        if (a == 0 && part < 0) continue;  // beyond -90 degrees
        const double azimuth = std::asin((a - 32 + part) / 32.0);
        EXPECT_EQ(fan.cellAt({range * std::cos(azimuth), range * std::sin(azimuth)}), r * kAngles + a);
      }
    }
  }
  EXPECT_EQ(fan.cellAt({-1, 0}), -1);
  EXPECT_EQ(fan.cellAt({kRanges * kBin_m, 0}), -1);
}

TEST(FanGeometry, BinsWithoutAnAngleHaveNoCells) {
  // Elements further apart than half a wavelength see less than the half disc.
  std::vector<double> azimuth;
  for (int a = 0; a < kAngles; ++a) {
    const double sine = 1.5 * (a - 32) / 32.0;
    azimuth.push_back(std::abs(sine) > 1 ? NAN : std::asin(sine));
  }
  const FanGeometry fan({0, 1, 2, 3}, azimuth);
  for (int a = 0; a < kAngles; ++a) {
    EXPECT_EQ(std::isnan(fan.sectors()[static_cast<std::size_t>(a)].from_rad),
              std::isnan(azimuth[static_cast<std::size_t>(a)]));
  }
  for (int deg = -80; deg <= 80; deg += 5) {
    const double angle = deg * M_PI / 180;
    const int cell = fan.cellAt({2 * std::cos(angle), 2 * std::sin(angle)});
    ASSERT_GE(cell, 0) << deg;
    EXPECT_EQ(cell % kAngles, 32 + std::lround(std::sin(angle) / 1.5 * 32)) << deg;
  }
}

TEST(FanGeometry, TheMeshCoversTheFanAndEachTexelItsCell) {
  const FanGeometry fan = paperFan();
  const FanMesh mesh = fan.mesh(0.02, HUGE_VAL);
  double area = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const auto &a = mesh.vertices[mesh.triangles[i]], &b = mesh.vertices[mesh.triangles[i + 1]],
               &c = mesh.vertices[mesh.triangles[i + 2]];
    const double own = std::abs(area_m2(a.place, b.place, c.place));
    if (own < 1e-9) continue;  // both near corners are the radar
    area += own;
    // A point within the triangle takes the texel of its own cell.
    for (double at : {0.1, 0.5, 0.8}) {
      const double w[3] = {0.2 * at, 0.8 - 0.2 * at, 0.2};
      const auto mix = [&](double p, double q, double r) { return w[0] * p + w[1] * q + w[2] * r; };
      const FanPoint place{mix(a.place.x_m, b.place.x_m, c.place.x_m), mix(a.place.y_m, b.place.y_m, c.place.y_m)};
      const double row = mix(a.v, b.v, c.v) * kRanges, column = mix(a.u, b.u, c.u) * kAngles;
      const int cell = fan.cellAt(place);
      EXPECT_EQ(cell % kAngles, static_cast<int>(column));
      if (std::abs(row - std::round(row)) > 0.02) {
        EXPECT_EQ(cell / kAngles, static_cast<int>(row));
      }
    }
  }
  const double from = fan.sectors().front().from_rad, to = fan.sectors().back().to_rad;
  const double expected = 0.5 * fan.farthest_m() * fan.farthest_m() * (to - from);
  EXPECT_NEAR(area, expected, 1e-4 * expected);  // chords of 0.02 rad
}

TEST(FanGeometry, AMeshEndsWhereItShall) {
  double farthest = 0;
  for (const auto& v : paperFan().mesh(0.02, 3).vertices)
    farthest = std::max(farthest, std::hypot(v.place.x_m, v.place.y_m));
  EXPECT_NEAR(farthest, 3, kBin_m);
}

TEST(FanGeometry, AxesThatDoNotAscendAreRefused) {
  EXPECT_THROW(FanGeometry({0, 1, 1}, {-0.1, 0.1}), InputError);
  EXPECT_THROW(FanGeometry({0, NAN, 1}, {-0.1, 0.1}), InputError);
  EXPECT_THROW(FanGeometry({0, 1}, {0.1, -0.1}), InputError);
  EXPECT_THROW(FanGeometry({0, 1}, {NAN, 0.1}), InputError);
  EXPECT_THROW(FanGeometry({}, {-0.1, 0.1}), InputError);
}

}  // namespace
}  // namespace mmradartwin
