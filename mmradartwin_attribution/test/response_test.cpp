#include "mmradartwin_attribution/response.h"

#include <gtest/gtest.h>

#include "mmradartwin_dsp/input_error.h"
#include "synthetic_map.h"

namespace mmradartwin {
namespace {

using synthetic::kDegree;

class ResponseTest : public ::testing::Test {
 protected:
  RadarConfig radar_ = paperRadar();
  SignalChain chain_{radar_};
  EvaluationField field_{AttributionConfig(), radar_, chain_.axes()};

  std::vector<Response> strongerThan(const NormalisedMap& map, double level_db) const {
    std::vector<Response> result;
    for (const Response& r : map.responses) {
      if (r.level_db >= level_db) result.push_back(r);
    }
    return result;
  }
};

TEST_F(ResponseTest, FindsTwoTargetsWhereTheyAre) {
  const NormalisedMap map = field_.normalise(synthetic::map(radar_, {{3.07, 20, 0}, {5.03, -30, -10}}));
  const auto found = strongerThan(map, -25);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0].range_m, 3.07, 0.03);
  EXPECT_NEAR(found[0].azimuth_rad / kDegree, 20, 0.7);
  EXPECT_NEAR(found[0].level_db, 0, 1e-9);
  EXPECT_NEAR(found[1].range_m, 5.03, 0.03);
  EXPECT_NEAR(found[1].azimuth_rad / kDegree, -30, 0.7);
  // Hann loses up to 1.4 dB between bins, so two levels compare to within that.
  EXPECT_NEAR(found[1].level_db, -10, 1.5);
}

TEST_F(ResponseTest, SidelobesOfTheUntaperedArrayAreNoResponses) {
  const NormalisedMap map = field_.normalise(synthetic::map(radar_, {{4.0, 10, 0}}));
  int local_maxima = 0;
  for (int a = 1; a + 1 < kAngleBins; ++a) {
    const int r = map.responses.front().range_bin;
    const double v = map.level_db(r, a);
    local_maxima += v > -18 && v > map.level_db(r, a - 1) && v >= map.level_db(r, a + 1);
  }
  ASSERT_GT(local_maxima, 2) << "the map itself must show sidelobes";
  EXPECT_EQ(strongerThan(map, -40).size(), 1u);
}

TEST_F(ResponseTest, ATargetAboveASidelobeIsAResponse) {
  // First sidelobe of 8 elements: 1.43/8 of the period of the sine beside the peak, 13 dB down.
  const double period = radar_.wavelength_m() / radar_.virtual_pitch_m();
  const double beside = std::asin(1.43 / 8 * period) / kDegree;
  EXPECT_EQ(strongerThan(field_.normalise(synthetic::map(radar_, {{4.0, 0, 0}, {4.0, beside, -5}})), -15).size(), 2u);
  EXPECT_EQ(strongerThan(field_.normalise(synthetic::map(radar_, {{4.0, 0, 0}, {4.0, beside, -30}})), -25).size(), 1u);
}

TEST_F(ResponseTest, PointResponseIsWhatTheChainGives) {
  const RangeAngleMap map = synthetic::map(radar_, {{4.0, 0, 0}});
  const double range_bin = 4.0 / radar_.range_bin_m();
  const double peak_db = 20 * std::log10(1 / 1.0);
  for (int r = 20; r <= 32; ++r) {
    for (int a = 0; a < kAngleBins; ++a) {
      const double expected = field_.pointResponse(r - range_bin, a - kAngleBins / 2);
      if (expected < 1e-5) continue;
      EXPECT_NEAR(map.power_db(r, a) - peak_db, 10 * std::log10(expected), 0.15) << r << ", " << a;
    }
  }
}

TEST_F(ResponseTest, OnlyEvaluatedCellsSetTheNormalisation) {
  // Leakage within the near range and a strong echo at 70 deg; the strongest evaluated one is at 4 m.
  const NormalisedMap map = field_.normalise(synthetic::map(radar_, {{0.0, 0, 15}, {6.0, 70, 10}, {4.0, 0, 0}}));
  double peak = -100;
  for (int r = 0; r < 64; ++r) {
    for (int a = 0; a < kAngleBins; ++a) {
      EXPECT_LE(map.level_db(r, a), 0);
      EXPECT_GE(map.level_db(r, a), -50);
      if (field_.field(r, a) == Field::kCentral) peak = std::max(peak, map.level_db(r, a));
    }
  }
  EXPECT_DOUBLE_EQ(peak, 0);
  EXPECT_EQ(field_.field(1, 32), Field::kExcluded) << "bin 1 lies at 0.156 m";
  EXPECT_EQ(field_.field(2, 32), Field::kCentral);
  EXPECT_EQ(field_.field(2, 63), Field::kOuter);
  for (const Response& r : map.responses) EXPECT_NE(r.field, Field::kExcluded);
}

TEST_F(ResponseTest, WindowsAreNoNarrowerThanABin) {
  const MatchWindow point{0, 0};
  EXPECT_TRUE(field_.inWindow(point, 3, 0, 3 + 0.99 * radar_.range_bin_m(), 0));
  EXPECT_FALSE(field_.inWindow(point, 3, 0, 3 + 1.01 * radar_.range_bin_m(), 0));
  const MatchWindow tight = AttributionConfig().tight;
  EXPECT_TRUE(field_.inWindow(tight, 3, 0, 3.199, 4.99 * kDegree));
  EXPECT_FALSE(field_.inWindow(tight, 3, 0, 3.201, 0));
  EXPECT_FALSE(field_.inWindow(tight, 3, 0, 3, -5.01 * kDegree));
}

TEST_F(ResponseTest, ForeignMapsAreRefused) {
  RangeAngleMap map = synthetic::map(radar_, {{4.0, 0, 0}});
  RangeAngleMap other = map;
  other.power_db.conservativeResize(32, kAngleBins);
  EXPECT_THROW(field_.normalise(other), InputError);
  other = map;
  for (double& r : other.axes.range_m) r *= 1.01;
  EXPECT_THROW(field_.normalise(other), InputError);
  other = map;
  other.power_db.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW(field_.normalise(other), InputError);
}

}  // namespace
}  // namespace mmradartwin
