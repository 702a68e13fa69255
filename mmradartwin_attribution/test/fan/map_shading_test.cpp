#include "map_shading.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr ColorMap kLevelMaps[] = {ColorMap::kViridis, ColorMap::kCividis, ColorMap::kMagma};
constexpr ColorMap kAllMaps[] = {ColorMap::kViridis, ColorMap::kCividis, ColorMap::kMagma, ColorMap::kBlueWhiteRed};

std::uint32_t argb(Rgb c) { return 0xff000000U | (std::uint32_t{c.r} << 16) | (std::uint32_t{c.g} << 8) | c.b; }

TEST(ColorScale, EndsAndMiddleHaveTheTablesColours) {
  for (ColorMap map : kAllMaps) {
    const auto& colors = colorsOf(map);
    const ColorScale scale{map, -40, 0};
    EXPECT_EQ(argb(scale.color(-40)), argb(colors.front()));
    EXPECT_EQ(argb(scale.color(-1000)), argb(colors.front()));
    EXPECT_EQ(argb(scale.color(0)), argb(colors.back()));
    EXPECT_EQ(argb(scale.color(7)), argb(colors.back()));
  }
  // Of the published table of viridis.
  EXPECT_EQ(argb((ColorScale{ColorMap::kViridis, -1, 0}.color(-1))), 0xff440154U);
  EXPECT_EQ(argb((ColorScale{ColorMap::kViridis, -1, 0}.color(0))), 0xfffde725U);
}

TEST(ColorScale, LevelsGrowLighterAllTheWay) {
  for (ColorMap map : kLevelMaps) {
    const auto& colors = colorsOf(map);
    ASSERT_EQ(colors.size(), 256u);
    for (std::size_t i = 8; i < colors.size(); i += 8) EXPECT_GT(luminance(colors[i]), luminance(colors[i - 8])) << i;
  }
}

TEST(ColorScale, ZeroOfAResidualIsWhiteAndBothSidesDarkenAlike) {
  const ColorScale scale{ColorMap::kBlueWhiteRed, -30, 30};
  EXPECT_EQ(argb(scale.color(0)), 0xffffffffU);
  for (double db = 1; db <= 30; db += 1) {
    const Rgb blue = scale.color(-db), red = scale.color(db);
    EXPECT_GT(blue.b, blue.r) << db;
    EXPECT_GT(red.r, red.b) << db;
    EXPECT_LT(luminance(blue), luminance(scale.color(1 - db)));
    EXPECT_LT(luminance(red), luminance(scale.color(db - 1)));
  }
}

TEST(Contrast, IsThatOfTheStandard) {
  EXPECT_NEAR(contrast({0, 0, 0}, {255, 255, 255}), 21, 1e-9);
  EXPECT_NEAR(contrast({119, 119, 119}, {255, 255, 255}), 4.48, 0.005);  // a known pair
  EXPECT_NEAR(contrast({10, 20, 30}, {10, 20, 30}), 1, 1e-12);
}

TEST(Contrast, OfABoxIsAtLeastThreeOnEveryColourOfEveryMap) {
  for (Rgb line : {kMatchedBox, kMismatchBox}) {
    EXPECT_GE(contrast(line, kBoxRim), 3);
    for (ColorMap map : kAllMaps) {
      for (Rgb cell : colorsOf(map)) EXPECT_GE(std::max(contrast(line, cell), contrast(kBoxRim, cell)), 3);
    }
    EXPECT_GE(std::max(contrast(line, kNoData), contrast(kBoxRim, kNoData)), 3);
  }
}

TEST(Contrast, OfWordsIsAtLeastThree) {
  // Words have a rim of the background; numbers of boxes stand on the box's rim colour.
  EXPECT_GE(contrast(kLabel, kBackground), 3);
  EXPECT_GE(contrast(kMismatchBox, kBoxRim), 3);
  EXPECT_GE(contrast(kGrid, kBackground), 3);
}

class Shading : public ::testing::Test {
 protected:
  Shading() {
    for (int r = 0; r < 4; ++r) range_.push_back(0.1 * r);
    for (int a = 0; a < 16; ++a) azimuth_.push_back(std::asin((a - 8) / 8.0));
    geometry_ = {range_, azimuth_};
    power_.assign(64, -60);
  }
  float& at(int r, int a) { return power_[static_cast<std::size_t>(16 * r + a)]; }
  std::uint32_t shown(int r, int a) const { return shaded_.argb[static_cast<std::size_t>(16 * r + a)]; }

  std::vector<double> range_, azimuth_;
  FanGeometry geometry_;
  std::vector<float> power_;
  MapShading shading_;
  ShadedMap shaded_;
};

TEST_F(Shading, ThePeakIsTheUpperEndAndTheSpanTheLower) {
  at(2, 8) = -17;
  at(2, 9) = -37;
  at(3, 9) = NAN;
  shade(geometry_, power_, shading_, shaded_);
  const auto& colors = colorsOf(ColorMap::kViridis);
  EXPECT_EQ(shown(2, 8), argb(colors[255]));
  EXPECT_EQ(shown(2, 9), argb(colors[128]));  // half of 40 dB
  EXPECT_EQ(shown(1, 1), argb(colors[0]));
  EXPECT_EQ(shown(3, 9), argb(kNoData));
  EXPECT_EQ(shaded_.reference_db, -17);
  for (std::size_t i = 0; i < power_.size(); ++i) {
    if (!std::isnan(power_[i])) EXPECT_EQ(shaded_.argb[i], argb(shaded_.scale.color(power_[i]))) << i;
  }
}

TEST_F(Shading, ThePeakIsLookedForWhereItCounts) {
  at(0, 8) = 0;   // too near
  at(3, 0) = -3;  // at -90 degrees
  at(3, 8) = -20;
  shading_.peak_beyond_m = 0.06;
  shading_.peak_azimuth_rad = 1.05;
  shade(geometry_, power_, shading_, shaded_);
  EXPECT_EQ(shaded_.scale.high_db, -20);
}

TEST_F(Shading, AFixedReferenceStaysAndTellsLevelsAsTheyAre) {
  at(2, 8) = -17;
  shading_.reference_db = -10;
  shade(geometry_, power_, shading_, shaded_);
  EXPECT_EQ(shaded_.scale.high_db, -10);
  EXPECT_EQ(shaded_.scale.low_db, -50);
  EXPECT_EQ(shaded_.reference_db, 0);
}

TEST_F(Shading, WhatIsMaskedIsNotShown) {
  shading_.mask_azimuth_rad = M_PI / 3;
  shade(geometry_, power_, shading_, shaded_);
  for (int a = 0; a < 16; ++a) {
    const bool inside = std::abs(a - 8) <= 6;  // asin(6/8) = 48.6, asin(7/8) = 61 degrees
    EXPECT_EQ(shown(1, a) != 0, inside) << a;
  }
}

TEST_F(Shading, AResidualIsNotNormalised) {
  at(2, 8) = 0;
  at(2, 9) = 30;
  at(2, 10) = -45;
  shading_.residual = true;
  shade(geometry_, power_, shading_, shaded_);
  EXPECT_EQ(shown(2, 8), 0xffffffffU);
  EXPECT_EQ(shown(2, 9), argb(colorsOf(ColorMap::kBlueWhiteRed).back()));
  EXPECT_EQ(shown(2, 10), argb(colorsOf(ColorMap::kBlueWhiteRed).front()));
}

TEST_F(Shading, FadedCellsAreTheMoreTransparentTheWeaker) {
  at(2, 8) = 0;
  at(2, 9) = -30;
  at(2, 10) = -15;
  at(2, 11) = NAN;
  ShadedMap faded;
  const auto alpha = [&](int a) { return faded.argb[static_cast<std::size_t>(32 + a)] >> 24; };
  shade(geometry_, power_, shading_, shaded_);
  fade(power_, shaded_, faded);
  EXPECT_EQ(faded.argb[40], shaded_.argb[40]);
  EXPECT_EQ(alpha(9), 127u);  // a quarter of 40 dB above the lower end
  EXPECT_EQ(alpha(10), 255u);
  EXPECT_EQ(alpha(11), 0u);
  EXPECT_EQ(alpha(1), 0u);
  shading_.residual = true;
  shade(geometry_, power_, shading_, shaded_);
  fade(power_, shaded_, faded);
  EXPECT_EQ(alpha(8), 0u);
  EXPECT_EQ(alpha(9), 255u);
  EXPECT_EQ(alpha(10), 255u);
}

TEST_F(Shading, AMapOfAnotherShapeIsRefused) {
  power_.pop_back();
  EXPECT_THROW(shade(geometry_, power_, shading_, shaded_), InputError);
}

TEST(FarthestOver, IsTheFarEdgeOfTheLastCellThatIsShownAndStrongEnough) {
  const FanGeometry geometry({0, 1, 2, 3, 4}, {-1.2, 0, 1.2});
  std::vector<float> power_db(15, -80);
  power_db[1 * 3 + 1] = 0;
  power_db[2 * 3 + 1] = -25;
  power_db[3 * 3 + 1] = -35;
  power_db[4 * 3 + 0] = 0;  // beyond what is shown
  MapShading shading;
  shading.mask_azimuth_rad = 1;
  shading.peak_azimuth_rad = 1;
  ShadedMap shaded;
  shade(geometry, power_db, shading, shaded);
  EXPECT_DOUBLE_EQ(farthestOver_m(geometry, power_db, shaded, 30), 2.5);
  EXPECT_DOUBLE_EQ(farthestOver_m(geometry, power_db, shaded, 40), 3.5);
  EXPECT_DOUBLE_EQ(farthestOver_m(geometry, power_db, shaded, 10), 1.5);
  EXPECT_DOUBLE_EQ(farthestOver_m(geometry, power_db, shaded, -1), 0);
}

}  // namespace
}  // namespace mmradartwin
