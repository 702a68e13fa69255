#include "diagnosis/hypotheses/hypothesis.h"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis {
namespace {

const Coordinate kOffset{"range_m", "m", -1, 0, 0.03, -1, 1, {}};
const Coordinate kLevel{"level_db", "dB", -1, -100, -20, -100, 20, {}};
const Coordinate kCorner{"corner_hz", "Hz", -1, 1e9, 2e6, 1e5, 1e9, {}};

TEST(Coordinate, ScaleIsZeroWhereItDoesNothingAndOneAtItsTypicalValue) {
  EXPECT_DOUBLE_EQ(kOffset.value(0), 0);
  EXPECT_DOUBLE_EQ(kOffset.value(1), 0.03);
  EXPECT_DOUBLE_EQ(kLevel.value(1), -20);
  EXPECT_DOUBLE_EQ(kCorner.value(1), 2e6);
}

TEST(Coordinate, ScaleOfALevelIsPowerAndOfACornerFrequencyItsInverse) {
  EXPECT_NEAR(kLevel.value(10), -10, 1e-12);
  EXPECT_NEAR(kCorner.value(2), 1e6, 1e-6);
}

TEST(Coordinate, ScaledIsTheInverseOfValueAndSlopeItsDerivative) {
  for (const Coordinate& c : {kOffset, kLevel, kCorner}) {
    for (double scaled : {0.3, 1.0, 2.5}) {
      EXPECT_NEAR(c.scaled(c.value(scaled)), scaled, 1e-9) << c.parameter;
      const double step = 1e-6 * scaled;
      const double difference = (c.value(scaled + step) - c.value(scaled - step)) / (2 * step);
      EXPECT_NEAR(c.slope(scaled), difference, 1e-4 * std::abs(difference)) << c.parameter;
    }
  }
}

TEST(Coordinate, ValuesStayWithinTheirRange) {
  EXPECT_DOUBLE_EQ(kOffset.value(1000), 1);
  EXPECT_DOUBLE_EQ(kOffset.value(-1000), -1);
  EXPECT_DOUBLE_EQ(kLevel.value(0), -100);
}

TEST(Coordinate, OneSidedIsWhatMayBeThereOrNot) {
  EXPECT_TRUE(kLevel.oneSided());
  EXPECT_FALSE(kOffset.oneSided());
  EXPECT_TRUE((Coordinate{"level", "1", -1, 0, 1, 0, 4, {}}.oneSided()));
}

TEST(Hypothesis, SetsNumbersAndElementsOfListsAndLeavesOthers) {
  Hypothesis h;
  h.mechanism = defaultMechanism("channel_phase_error");
  h.mechanism.values.set("phase_deg", std::vector<double>{0, 0, 0});
  h.coordinates = {{"phase_deg", "deg", 1, 0, 10, -180, 180, {}}, {"phase_deg", "deg", 2, 0, 10, -180, 180, {}}};
  const std::vector<double> expected = {0, 5, -20};
  EXPECT_EQ(h.at({0.5, -2}).values.numbers("phase_deg"), expected);
}

TEST(Hypothesis, AShapeIsAddedToAllOfAList) {
  Hypothesis h;
  h.mechanism = defaultMechanism("channel_phase_error");
  h.mechanism.values.set("gain_db", std::vector<double>{1, 1, 1});
  h.coordinates = {{"gain_db", "dB", -1, 0, 1, -40, 40, {0, 1, 2}}};
  const std::vector<double> expected = {1, 1.5, 2};
  EXPECT_EQ(h.at({0.5}).values.numbers("gain_db"), expected);
}

TEST(Hypothesis, KindsFollowFromTheCatalogue) {
  Hypothesis move, yaw, loss;
  move.mechanism = defaultMechanism("actor_moved");
  yaw.mechanism = defaultMechanism("radar_yaw_offset");
  yaw.coordinates = {{"yaw_deg", "deg", -1, 0, 0.5, -180, 180, {}}};
  loss.mechanism = defaultMechanism("excess_attenuation");
  loss.coordinates = {{"db_per_m", "dB/m", -1, 0, 0.5, -20, 20, {}}};
  EXPECT_TRUE(move.isMove());
  EXPECT_FALSE(yaw.isMove());
  EXPECT_TRUE(yaw.isGeometry());
  EXPECT_FALSE(loss.isGeometry());
  yaw.subject = "cabinet";
  EXPECT_FALSE(yaw.isGeometry()) << "about one actor";
}

TEST(Hypotheses, AMechanismReplacesWhatItExcludesAndElseStandsLast) {
  std::vector<NamedParameters> mechanisms = {defaultMechanism("specular"), defaultMechanism("range_bias")};
  NamedParameters bias = defaultMechanism("range_bias");
  bias.values.set("range_m", 0.5);
  replaceOrAppend(bias, mechanisms);
  ASSERT_EQ(mechanisms.size(), 2u);
  EXPECT_EQ(mechanisms[1].values.number("range_m"), 0.5);
  replaceOrAppend(defaultMechanism("element_pattern"), mechanisms);
  ASSERT_EQ(mechanisms.size(), 3u);
  EXPECT_EQ(mechanisms[2].mechanism, "element_pattern");
}

TEST(Hypotheses, StepsTakeThePlaceOfARate) {
  Hypothesis drift;
  drift.mechanism = defaultMechanism("gain_drift");
  drift.coordinates = {{"db_per_hour", "dB/h", -1, 0, 1, -100, 100, {}}};
  const std::optional<Hypothesis> stepped = withSteps(drift, 2);
  ASSERT_TRUE(stepped);
  EXPECT_EQ(stepped->coordinates.size(), 2u);
  EXPECT_EQ(stepped->at({1, -1}).values.numbers("steps_db").size(), 2u);
  Hypothesis bias;
  bias.mechanism = defaultMechanism("range_bias");
  EXPECT_FALSE(withSteps(bias, 1));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
