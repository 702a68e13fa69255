#include "diagnosis/rounds/move_within_errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"
#include "diagnosis/fit/diagnosis_context.h"

namespace mmradartwin::diagnosis {
namespace {

/// A room whose east cupboard stands elsewhere, and fits of that.
class RoomWithAMove : public ::testing::Test {
 protected:
  void measure(double dx_m, double dy_m) {
    NamedParameters moved = mechanismWith("actor_moved", {{"dx_m", dx_m}, {"dy_m", dy_m}});
    moved.values.set("actor", std::string("east"));
    room_.measure({firstOrder()[0], moved});
    context_.emplace(recording_, *room_.twin, room_.data, options_, options_.accuracy, 3);
    context_->echoes.pointBeams(room_.data, firstOrder(), context_->likelihood.firstBin());
    null_ = context_->fitter.state(firstOrder(), nullptr);
    context_->echoes.setBaseline(firstOrder());
  }
  HypothesisFit fitFrom(double dx_m, double dy_m) {
    const Hypothesis move = hypothesisOf(
        "actor_moved", {{"dx_m", "m", -1, 0, 0.05, -3, 3, {}}, {"dy_m", "m", -1, 0, 0.05, -3, 3, {}}}, "actor", "east");
    HypothesisFit fit = context_->fitter.fit(null_, move, {{dx_m / 0.05, dy_m / 0.05}});
    context_->echoes.setBaseline(firstOrder());
    return fit;
  }
  std::optional<HypothesisFit> small(const HypothesisFit& far) {
    return rounds::moveWithinErrors(*context_, null_, far, 300);
  }
  DiagnosisOptions options_;
  const double least_m_ = StatedBounds(options_.accuracy).leastMove_m();
  MadeRoom room_{10};
  Recording recording_;
  std::optional<DiagnosisContext> context_;
  ModelState null_;
};

TEST_F(RoomWithAMove, ASlideAlongTheOwnFrontIsTheSmallErrorThatItTakesAlong) {
  measure(0.03, 0);
  const HypothesisFit slid = fitFrom(0.03, 2.5 * least_m_);
  ASSERT_GT(slid.moved_m(), least_m_);
  const std::optional<HypothesisFit> found = small(slid);
  ASSERT_TRUE(found);
  EXPECT_LE(std::abs(found->hypothesis.coordinates[1].value(found->scaled_values[1])), least_m_);
  EXPECT_NEAR(found->hypothesis.coordinates[0].value(found->scaled_values[0]) + found->state.latents.actor_range_m[0],
              0.03, 0.01);
}

TEST_F(RoomWithAMove, AMoveThatRangesShowIsNoSmallOne) {
  measure(2.5 * least_m_, 0);
  const HypothesisFit moved = fitFrom(2.4 * least_m_, 0);
  ASSERT_NEAR(moved.moved_m(), 2.5 * least_m_, 0.02);
  EXPECT_FALSE(small(moved));
}

TEST_F(RoomWithAMove, AMoveThatIsSmallNeedsNoOther) {
  measure(0.03, 0);
  EXPECT_FALSE(small(fitFrom(0.03, 0)));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
