#include "diagnosis/hypotheses/evidence_bounds.h"

#include <gtest/gtest.h>

#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis {
namespace {

Hypothesis hypothesisOf(const std::string& mechanism, const std::vector<Coordinate>& coordinates) {
  Hypothesis h;
  h.mechanism = defaultMechanism(mechanism);
  h.coordinates = coordinates;
  return h;
}
const Coordinate kSlope{"db_per_m", "dB/m", -1, 0, 0.5, -20, 20, {}};
const Coordinate kSize{"level", "1", -1, 0, 1, 0, 4, {}};

TEST(EvidenceBounds, AnObjectNeedsMoreThanALawAndALawThatMovesEchoesMoreThanOneOfLevels) {
  const Hypothesis loss = hypothesisOf("excess_attenuation", {kSlope});
  const Hypothesis object = hypothesisOf("actor_unmodelled", {});
  EXPECT_GT(leastNats(object, {}, true, 10), leastNats(loss, {1}, true, 10));
  EXPECT_GT(leastNats(loss, {1}, true, 10), leastNats(loss, {1}, false, 10));
}

TEST(EvidenceBounds, GrowWithThePosesOfALongSession) {
  const Hypothesis loss = hypothesisOf("excess_attenuation", {kSlope});
  EXPECT_EQ(leastNats(loss, {1}, false, 5), leastNats(loss, {1}, false, 10)) << "few poses: a constant";
  EXPECT_DOUBLE_EQ(leastNats(loss, {1}, false, 2000) / leastNats(loss, {1}, false, 1000), 2);
}

TEST(EvidenceBounds, AnAdditionBelowItsTheoreticalSizeNeedsMore) {
  const Hypothesis edges = hypothesisOf("edge_diffraction", {kSize});
  EXPECT_GT(leastNats(edges, {0.5}, false, 100), leastNats(edges, {1.0}, false, 100));
  EXPECT_TRUE(isFaintAddition(edges, {0.5}));
  EXPECT_FALSE(isFaintAddition(edges, {1.0}));
}

TEST(EvidenceBounds, LawsOfLevelsAreThoseThatNeitherAddNorMoveEchoes) {
  EXPECT_TRUE(isOfLevels(hypothesisOf("excess_attenuation", {kSlope})));
  EXPECT_FALSE(isOfLevels(hypothesisOf("edge_diffraction", {kSize})));
  EXPECT_FALSE(isOfLevels(hypothesisOf("range_bias", {{"range_m", "m", -1, 0, 0.03, -1, 1, {}}})));
}

TEST(EvidenceBounds, OverdispersionOfFewPlacesIsDrawnToTheUsualOneAndOfManyStays) {
  const Hypothesis loss = hypothesisOf("excess_attenuation", {kSlope});
  const UsualScatter usual = usualScatter(loss);
  ASSERT_GT(usual.places, 0);
  // Weights are degrees of freedom: places of the session less one, and those that the usual one is worth.
  EXPECT_DOUBLE_EQ(shrunkOverdispersion(4, loss, 3),
                   (usual.places * usual.overdispersion + 2 * 4) / (usual.places + 2));
  EXPECT_NEAR(shrunkOverdispersion(4, loss, 100000), 4, 0.01);
  EXPECT_EQ(shrunkOverdispersion(0.1, loss, 100000), 1) << "never below one";
  const Hypothesis object = hypothesisOf("actor_unmodelled", {});
  EXPECT_EQ(shrunkOverdispersion(4, object, 3), 4) << "nothing usual is known";
}

}  // namespace
}  // namespace mmradartwin::diagnosis
