#include "mmradartwin_attribution/pose_walk.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

using Sequence = std::vector<std::size_t>;

std::vector<PoseScore> fourPoses() {
  return {{0.8, 0.1, 0.3, 5}, {0.2, 0.4, 0.3, 9}, {std::nan(""), 0.2, 0.1, 7}, {0.5, 0.4, 0.2, 3}};
}

TEST(PoseOrder, PutsTheWorstFirstAndPosesWithoutAScoreLast) {
  EXPECT_EQ(orderedPoses(fourPoses(), PoseOrder::kRecorded), (Sequence{0, 1, 2, 3}));
  EXPECT_EQ(orderedPoses(fourPoses(), PoseOrder::kRecall), (Sequence{1, 3, 0, 2}));
  EXPECT_EQ(orderedPoses(fourPoses(), PoseOrder::kQ1Energy), (Sequence{1, 3, 2, 0}));
  EXPECT_EQ(orderedPoses(fourPoses(), PoseOrder::kQ2Energy), (Sequence{0, 1, 3, 2}));
  EXPECT_EQ(orderedPoses(fourPoses(), PoseOrder::kResidual), (Sequence{1, 2, 0, 3}));
}

TEST(PoseOrder, IsKnownByItsName) {
  for (const std::string& name : poseOrderNames()) EXPECT_EQ(poseOrderName(*poseOrderOf(name)), name);
  EXPECT_FALSE(poseOrderOf("beauty"));
}

TEST(PoseWalk, KeepsTheShownPoseWhereTheOrderChanges) {
  PoseWalk walk(fourPoses());
  walk.step(3);
  walk.setOrder(PoseOrder::kRecall);
  EXPECT_EQ(walk.index(), 3u);
  EXPECT_EQ(walk.rank(), 1u);
  walk.step(1);
  EXPECT_EQ(walk.index(), 0u);
  walk.showFirst();
  EXPECT_EQ(walk.index(), 1u);
}

TEST(PoseWalk, GoesOnAtTheOtherEnd) {
  PoseWalk walk(fourPoses());
  walk.step(-1);
  EXPECT_EQ(walk.index(), 3u);
  walk.step(1);
  EXPECT_EQ(walk.index(), 0u);
  walk.step(-9);
  EXPECT_EQ(walk.index(), 3u);
  walk.show(2);
  EXPECT_EQ(walk.index(), 2u);
}

TEST(PoseWalk, NeedsAPose) { EXPECT_THROW(PoseWalk({}), InputError); }

}  // namespace
}  // namespace mmradartwin
