#include "diagnosis/channels/pose_time_lag.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace mmradartwin::diagnosis {
namespace {

constexpr double kPeriod_s = 0.05, kStand_s = 2, kWay_s = 1.5, kStep_m = 0.8;

/// How far a radar has gone that stands for 2 s, goes 0.8 m in 1.5 s, and so on.
double wayAt(double t_s, int motions) {
  const double cycle_s = kStand_s + kWay_s;
  const double i = std::floor(t_s / cycle_s);
  if (i >= motions) return motions * kStep_m;
  const double on_the_way_s = std::max(0.0, t_s - i * cycle_s - kStand_s);
  return kStep_m * (i + 0.5 - 0.5 * std::cos(M_PI * on_the_way_s / kWay_s));
}

struct Walk {
  std::vector<StampedTransform> track;
  std::vector<MovingStretch> motions;
  std::vector<std::vector<FrameChange>> changes;
  std::optional<PoseTimeLag> lag() const { return findPoseTimeLag(track, 0, motions, changes, kPeriod_s); }
};

/// tf says it lag_s late and trembles by a millimetre. noise: of a frame's power over that of its echoes.
Walk walk(int motions, double lag_s, double noise, unsigned seed) {
  Walk w;
  std::mt19937 random(seed);
  std::normal_distribution<double> tremble(0, 0.001), spread(0, 1);
  std::uniform_real_distribution<double> phase(0, 2 * M_PI);
  const double end_s = motions * (kStand_s + kWay_s) + kStand_s;
  const int frames = static_cast<int>(end_s / kPeriod_s);
  std::vector<FrameChange> all;
  for (int i = 0; i < frames; ++i) {
    const double t_s = i * kPeriod_s;
    StampedTransform reported;
    reported.stamp_ns = std::llround(1e9 * t_s);
    reported.T_map_radar.translation().x() = wayAt(std::max(0.0, t_s - lag_s), motions) + tremble(random);
    w.track.push_back(reported);
    if (i == 0) continue;
    const double gone_m = wayAt(t_s, motions) - wayAt(t_s - kPeriod_s, motions);
    const double turned_rad = std::min(1.0, gone_m / 0.0003) * phase(random);
    const double noisy = noise * (1 + 0.3 * std::abs(spread(random)));
    all.push_back({t_s - 0.5 * kPeriod_s, (noisy + 1 - std::cos(turned_rad)) / (1 + noise)});
  }
  w.motions = motionsOf(w.track, 0);
  for (const MovingStretch& m : w.motions) {
    w.changes.emplace_back();
    for (const FrameChange& c : all) {
      if (c.at_s > m.from_s - 1.2 && c.at_s < m.to_s + 1.2) w.changes.back().push_back(c);
    }
  }
  return w;
}

TEST(PoseTimeLag, IsWhatFramesComeBeforeTf) {
  for (double lag_s : {-0.4, -0.1, 0.08, 0.15, 0.6}) {
    for (double noise : {1e-4, 0.05}) {
      const Walk w = walk(6, lag_s, noise, 3);
      ASSERT_EQ(w.motions.size(), 6u) << lag_s;
      const std::optional<PoseTimeLag> lag = w.lag();
      ASSERT_TRUE(lag) << lag_s;
      EXPECT_NEAR(lag->lag_s, lag_s, 0.02) << noise;
      EXPECT_LT(lag->standard_error_s, 0.02) << lag_s;
      EXPECT_LT(lag->false_alarm_rate, 0.01) << lag_s;
    }
  }
}

TEST(PoseTimeLag, IsNoneOfTransformsInTime) {
  int alarms = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    const std::optional<PoseTimeLag> lag = walk(6, 0, 1e-3, seed).lag();
    ASSERT_TRUE(lag);
    EXPECT_LT(std::abs(lag->lag_s), 0.02) << seed;
    alarms += lag->false_alarm_rate < 0.01 && std::abs(lag->lag_s) >= 0.02 ? 1 : 0;
  }
  EXPECT_EQ(alarms, 0);
}

TEST(PoseTimeLag, NeedsThreeMotionsAndFramesThatShowThem) {
  EXPECT_FALSE(walk(2, 0.2, 1e-3, 1).lag());
  EXPECT_FALSE(walk(6, 0.2, 50, 1).lag());  // no two frames have anything in common, at rest or not
  EXPECT_TRUE(motionsOf({}, 0).empty());
}

TEST(PoseTimeLag, LeavesOutMotionsOfWhichFramesAreMissing) {
  Walk w = walk(4, 0.1, 1e-3, 1);
  const auto missing = [&](const StampedTransform& t) {
    const double t_s = 1e-9 * static_cast<double>(t.stamp_ns);
    return t_s > w.motions[1].from_s + 0.5 && t_s < w.motions[1].from_s + 1.0;
  };
  w.track.erase(std::remove_if(w.track.begin(), w.track.end(), missing), w.track.end());
  EXPECT_EQ(motionsOf(w.track, 0).size(), 3u);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
