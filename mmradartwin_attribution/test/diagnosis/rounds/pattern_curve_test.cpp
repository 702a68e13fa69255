#include "diagnosis/rounds/pattern_curve.h"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/catalogue/default_mechanism.h"

using namespace mmradartwin;
using namespace mmradartwin::diagnosis;

namespace {

Hypothesis cosine(double exponent) {
  Hypothesis h;
  h.mechanism = catalogue::defaultMechanism("element_pattern");
  h.mechanism.values.set("cos_exponent", exponent);
  return h;
}

/// A law of all levels that falls from `ahead_db` at 0 degrees to 0 at 60 on both sides.
Hypothesis roof(double ahead_db) {
  Hypothesis h;
  h.mechanism = catalogue::defaultMechanism("empirical_law");
  h.mechanism.values.set("variable", std::string("azimuth_deg"));
  h.mechanism.values.set("at", std::vector<double>{-60, 0, 60});
  h.mechanism.values.set("gain_db", std::vector<double>{0, ahead_db, 0});
  return h;
}

struct Curve {
  std::vector<double> angles_deg, gain_db;
};

Curve curveOf(double exponent, double ahead_db) {
  const auto [hypothesis, start] =
      rounds::patternCurve(cosine(exponent), cosine(exponent).mechanism.values, roof(ahead_db).mechanism.values);
  const Parameters values = hypothesis.at(start).values;
  EXPECT_EQ(values.number("cos_exponent"), 0);
  return {values.numbers("angles_deg"), values.numbers("gain_db")};
}

}  // namespace

TEST(PatternCurve, FollowsAPowerOfTheCosine) {
  const Curve curve = curveOf(3, 0);
  ASSERT_EQ(curve.angles_deg.size(), curve.gain_db.size());
  for (std::size_t i = 0; i < curve.angles_deg.size(); ++i) {
    const double angle_deg = curve.angles_deg[i];
    if (std::abs(angle_deg) > 67.5) continue;
    EXPECT_NEAR(curve.gain_db[i], 30 * std::log10(std::cos(angle_deg * M_PI / 180)), 0.4) << angle_deg;
  }
  EXPECT_GE(curve.angles_deg.back(), 80);
}

TEST(PatternCurve, HasHalfOfTheLawInEachWay) {
  const Curve curve = curveOf(0, 8);
  for (std::size_t i = 0; i < curve.angles_deg.size(); ++i) {
    if (curve.angles_deg[i] == 0) {
      EXPECT_NEAR(curve.gain_db[i], 0, 1e-9);
    }
    if (std::abs(curve.angles_deg[i]) == 45) {
      EXPECT_NEAR(curve.gain_db[i], -3, 1e-9);
    }
    if (std::abs(curve.angles_deg[i]) == 67.5) {
      EXPECT_NEAR(curve.gain_db[i], -4, 1e-9);
    }
  }
}

TEST(PatternCurve, TakesLawsOfAllLevelsOverItsAngle) {
  EXPECT_EQ(rounds::angleOfPattern(cosine(1)), "azimuth_deg");
  EXPECT_FALSE(rounds::angleOfPattern(roof(1)));
  EXPECT_TRUE(rounds::isLawOfAllLevels(roof(1), "azimuth_deg"));
  EXPECT_FALSE(rounds::isLawOfAllLevels(roof(1), "range_m"));
  EXPECT_FALSE(rounds::isLawOfAllLevels(cosine(1), "azimuth_deg"));
  Hypothesis of_actor = roof(1);
  of_actor.mechanism.values.set("actor", std::string("cabinet"));
  EXPECT_FALSE(rounds::isLawOfAllLevels(of_actor, "azimuth_deg"));
}
