#include "diagnosis/hypotheses/fitted_parameters.h"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis {
namespace {

Hypothesis biasOf() {
  Hypothesis h;
  h.mechanism = defaultMechanism("range_bias");
  h.coordinates = {{"range_m", "m", -1, 0, 0.03, -1, 1, {}}};
  return h;
}

TEST(FittedParameters, HaveTheNameUnitAndValueOfTheirCause) {
  const std::vector<FindingParameter> parameters = fittedParameters(biasOf(), {2}, {0.004}, "range_bias", 17);
  ASSERT_EQ(parameters.size(), 1u);
  EXPECT_EQ(parameters[0].name, "range_m");
  EXPECT_EQ(parameters[0].unit, "m");
  EXPECT_DOUBLE_EQ(std::get<double>(parameters[0].value), 0.06);
}

TEST(FittedParameters, IntervalsAreCentredAndWiderTheFewerThePlaces) {
  const auto widthOf = [](std::size_t locations) {
    const FindingParameter p = fittedParameters(biasOf(), {2}, {0.004}, "range_bias", locations)[0];
    EXPECT_NEAR((p.ci95[0][0] + p.ci95[0][1]) / 2, 0.06, 1e-12);
    return p.ci95[0][1] - p.ci95[0][0];
  };
  // Student's t at 97.5 %: 4.303 of 2 degrees of freedom, 1.984 of 100.
  EXPECT_NEAR(widthOf(3) / widthOf(101), 4.303 / 1.984, 1e-3);
  EXPECT_GT(widthOf(101), 2 * 1.96 * 0.004) << "no narrower than the standard error says";
}

TEST(FittedParameters, HaveAnOptionalOneWhereItIsNotTheUsual) {
  Hypothesis floor;
  floor.mechanism = defaultMechanism("floor_ceiling_multipath");
  floor.coordinates = {{"level", "1", -1, 0, 1, 0, 100, {}}};
  const auto namesOf = [&] {
    std::vector<std::string> names;
    for (const FindingParameter& p : fittedParameters(floor, {1}, {0.1}, "floor_ceiling_multipath", 17)) {
      names.push_back(p.name);
    }
    return names;
  };
  EXPECT_EQ(namesOf(), std::vector<std::string>{"level"});
  floor.mechanism.values.set("max_elevation_deg", 90.0);
  EXPECT_EQ(namesOf(), (std::vector<std::string>{"level", "max_elevation_deg"}));
}

TEST(FittedParameters, IntervalsStayWithinTheParametersRange) {
  const FindingParameter p = fittedParameters(biasOf(), {33}, {0.5}, "range_bias", 17)[0];
  EXPECT_DOUBLE_EQ(p.ci95[0][1], 1);
}

TEST(FittedParameters, NatsFromNothingAreHalfTheSquaredDistanceInErrors) {
  const double near = natsFromNothing(biasOf(), {1}, {0.01}), far = natsFromNothing(biasOf(), {2}, {0.01});
  EXPECT_DOUBLE_EQ(far / near, 4);
  EXPECT_DOUBLE_EQ(natsFromNothing(biasOf(), {1}, {0.005}) / near, 4);
  EXPECT_LT(near, 0.5 * std::pow(0.03 / 0.01, 2)) << "errors are taken somewhat wider than stated";
  EXPECT_GT(near, 0.25 * std::pow(0.03 / 0.01, 2));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
