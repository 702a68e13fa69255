#include "mmradartwin_attribution/mover_mask.h"

#include <gtest/gtest.h>

#include "mmradartwin_attribution/residual.h"
#include "synthetic_map.h"

namespace mmradartwin {
namespace {

using synthetic::kDegree;
using synthetic::Target;

class MoverMaskTest : public ::testing::Test {
 protected:
  RadarConfig radar_ = paperRadar();
  SignalChain chain_{radar_};
  EvaluationField field_{AttributionConfig(), radar_, chain_.axes()};
  const Target wall_{6.0, -20, 0}, walker_{3.0, 15, -3}, pillar_{3.0, -35, -1};
  MoverMask mask_{radar_};

  /// A moving detection at the cell of a target, with its level in one frame.
  Detection movingAt(const Target& target, double speed_m_per_s = 0.8) const {
    Detection d;
    d.range_bin = static_cast<int>(std::lround(target.range_m / radar_.range_bin_m()));
    double nearest = 10;
    for (int a = 0; a < kAngleBins; ++a) {
      const double away =
          std::abs(chain_.axes().azimuth_rad[static_cast<std::size_t>(a)] - target.azimuth_deg * kDegree);
      if (away < nearest) nearest = away, d.angle_bin = a;
    }
    d.power_db = target.level_db;
    d.radial_speed_m_per_s = speed_m_per_s;
    return d;
  }
  std::int64_t stampOf(int frame) const { return 1'700'000'000'000'000'000 + radar_.frame_offset_ns(frame); }
  /// An average that ends with this frame.
  RangeAngleMap measured(int last_frame = 10, int frames = 1) const {
    RangeAngleMap map = synthetic::map(radar_, {wall_, walker_, pillar_});
    map.stamp_ns = stampOf(last_frame);
    map.frames = frames;
    return map;
  }
  PoseAttribution compare(const RangeAngleMap& map) const {
    return attributePose(field_, map, synthetic::map(radar_, {wall_, pillar_}), {}, {});
  }
};

TEST_F(MoverMaskTest, WalkersCellsAreNotCompared) {
  const PoseAttribution before = compare(measured());
  ASSERT_EQ(before.residuals.size(), 1u);
  EXPECT_NEAR(before.residuals.front().range_m, walker_.range_m, 0.1);
  EXPECT_GT(before.central.q1_energy, 0.05);

  RangeAngleMap map = measured();
  mask_.add(stampOf(10), {movingAt(walker_)});
  const int masked = mask_.apply(field_, map);
  const PoseAttribution pose = compare(map);
  EXPECT_TRUE(pose.residuals.empty());
  EXPECT_LT(pose.central.q1_energy, 0.01);
  EXPECT_GT(masked, 100);
  for (int r = 0; r < pose.residual_db.rows(); ++r) {
    for (int a = 0; a < pose.residual_db.cols(); ++a) {
      if (field_.field(r, a) != Field::kCentral) continue;
      EXPECT_EQ(std::isnan(pose.residual_db(r, a)), std::isnan(map.power_db(r, a))) << r << " " << a;
    }
  }
  const Detection at = movingAt(walker_), wall_at = movingAt(wall_);
  EXPECT_TRUE(std::isnan(pose.residual_db(at.range_bin, at.angle_bin)));
  EXPECT_NEAR(pose.residual_db(wall_at.range_bin, wall_at.angle_bin), 0, 0.2);
  // A stride of range, the walker's beam and its sidelobes; not the pillar at the same range, which is stronger than
  // those.
  EXPECT_TRUE(std::isnan(map.power_db(at.range_bin + 2, at.angle_bin - 8)));
  EXPECT_TRUE(std::isnan(map.power_db(at.range_bin, at.angle_bin + 14)));
  EXPECT_FALSE(std::isnan(map.power_db(at.range_bin + 4, at.angle_bin)));
  const Detection pillar_at = movingAt(pillar_);
  EXPECT_NEAR(pose.residual_db(pillar_at.range_bin, pillar_at.angle_bin), 0, 3);
}

TEST_F(MoverMaskTest, WhatStandsStillOrHasNoSpeedIsCompared) {
  RangeAngleMap map = measured();
  mask_.add(stampOf(10), {movingAt(walker_, 0), movingAt(walker_, std::nan(""))});
  EXPECT_EQ(mask_.apply(field_, map), 0);
  EXPECT_FALSE(map.power_db.array().isNaN().any());
}

// One frame in a hundred leaves -40 dB of the walker, thirty -25 dB; what lies below -35 dB is less than weak.
TEST_F(MoverMaskTest, WhatAnAverageHasSpreadIsCompared) {
  RangeAngleMap map = measured(100, 100);
  for (int frame = 1; frame <= 99; ++frame) mask_.add(stampOf(frame), {});
  mask_.add(stampOf(100), {movingAt(walker_)});
  EXPECT_EQ(mask_.apply(field_, map), 0);
  MoverMask staying(radar_);
  for (int frame = 1; frame <= 100; ++frame) {
    staying.add(stampOf(frame), frame <= 70 ? std::vector<Detection>{} : std::vector<Detection>{movingAt(walker_)});
  }
  EXPECT_GT(staying.apply(field_, map), 0);
  // Every fifth frame tells the same as all of them.
  MoverMask sampled(radar_);
  for (int frame = 5; frame <= 100; frame += 5) {
    sampled.add(stampOf(frame), frame <= 70 ? std::vector<Detection>{} : std::vector<Detection>{movingAt(walker_)});
  }
  RangeAngleMap again = measured(100, 100);
  EXPECT_GT(sampled.apply(field_, again), 0);
}

TEST_F(MoverMaskTest, FramesBeforeTheAverageAndAfterItDoNotCount) {
  mask_.add(stampOf(8), {movingAt(walker_)});
  mask_.add(stampOf(9), {});
  mask_.add(stampOf(11), {movingAt(walker_)});
  RangeAngleMap map = measured(10, 1);
  EXPECT_EQ(mask_.apply(field_, map), 0);
  mask_.add(stampOf(10), {movingAt(walker_)});  // stamps go back: a bag that loops
  EXPECT_GT(mask_.apply(field_, map), 0);
}

}  // namespace
}  // namespace mmradartwin
