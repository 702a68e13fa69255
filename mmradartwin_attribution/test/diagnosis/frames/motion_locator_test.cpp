#include "diagnosis/frames/motion_locator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "mmradartwin_dsp/paper_radar.h"

namespace mmradartwin::diagnosis {
namespace {

/// Poses on a circle of 4 m that look at its middle, and what walkers show there by plain geometry: evidence in the
/// cell of their middle, and an echo a frame wherever they are then.
class MotionLocatorTest : public ::testing::Test {
 protected:
  struct Walker {
    double x_m, y_m, heading_rad, reach_m, speed_m_per_s;
  };

  std::vector<PoseMotion> poses(int count) {
    std::vector<PoseMotion> all;
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * M_PI * i / count;
      PoseMotion& p = all.emplace_back();
      p.pose.name = "p" + std::to_string(i);
      p.pose.location = "l" + std::to_string(i);
      p.pose.T_map_radar = Eigen::Translation3d(4 * std::cos(angle), 4 * std::sin(angle), 1.0) *
                           Eigen::AngleAxisd(angle + M_PI, Eigen::Vector3d::UnitZ());
      p.frames = kFrames;
      p.evidence = Eigen::ArrayXXf::Zero(radar_.samples_per_chirp, 64);
    }
    return all;
  }
  struct Seen {
    double range_m, azimuth_rad;
  };
  static Seen see(const PoseMotion& p, double x_m, double y_m) {
    const Eigen::Vector3d place = p.pose.T_map_radar.inverse() * Eigen::Vector3d(x_m, y_m, 1.0);
    return {place.norm(), std::atan2(place.y(), place.x())};
  }
  /// Nats into the cells about a place.
  void addEvidence(PoseMotion& p, const Seen& seen, float nats) {
    const int bin = static_cast<int>(std::lround(seen.range_m / radar_.range_bin_m()));
    const double sine = std::sin(seen.azimuth_rad) * 2 * radar_.virtual_pitch_m() / radar_.wavelength_m();
    const int beam = static_cast<int>(std::lround(32 * sine)) + 32;
    for (int b = bin - 1; b <= bin + 1; ++b) {
      for (int a = beam - 3; a <= beam + 3; ++a) {
        const float share = b == bin && a == beam ? 1.0f : 0.6f;
        if (b >= 0 && b < p.evidence.rows() && a >= 0 && a < 64) p.evidence(b, a) += share * nats;
      }
    }
  }
  /// To and fro on a line through its middle.
  void addWalker(PoseMotion& p, double begin_s, const Walker& w, float nats) {
    addEvidence(p, see(p, w.x_m, w.y_m), nats);
    std::normal_distribution<double> normal;
    for (int f = 0; f < kFrames; ++f) {
      const double way = (begin_s + f * radar_.frame_period_s) * w.speed_m_per_s / (4 * w.reach_m);
      const double along_m = w.reach_m * (4 * std::abs(way - std::floor(way) - 0.5) - 1);
      const Seen seen = see(p, w.x_m + along_m * std::cos(w.heading_rad), w.y_m + along_m * std::sin(w.heading_rad));
      MovingEcho echo;
      echo.frame = f;
      echo.range_m = seen.range_m + 0.03 * normal(random_);
      echo.azimuth_rad = seen.azimuth_rad + 0.01 * normal(random_);
      echo.snr = 100;
      echo.radial_m_per_s = std::numeric_limits<double>::quiet_NaN();
      p.echoes.push_back(echo);
    }
  }
  static double value(const FrameFinding& f, const std::string& name) {
    for (const FindingParameter& p : f.parameters) {
      if (p.name == name) return std::get<double>(p.value);
    }
    ADD_FAILURE() << f.cause << " has no " << name;
    return NAN;
  }
  static std::array<double, 2> interval(const FrameFinding& f, const std::string& name) {
    for (const FindingParameter& p : f.parameters) {
      if (p.name == name) return p.ci95.front();
    }
    return {NAN, NAN};
  }

  static constexpr int kFrames = 60;
  RadarConfig radar_ = paperRadar();
  std::mt19937_64 random_{3};
};

TEST_F(MotionLocatorTest, PutsAWalkerWhereAllPosesSeeIt) {
  const Walker walker{0.7, -0.4, 0.8, 0.35, 0.6};
  std::vector<PoseMotion> all = poses(8);
  for (std::size_t i = 0; i < all.size(); ++i) addWalker(all[i], 11.3 * static_cast<double>(i), walker, 60);
  const LocatedMotion found = locateMotion(radar_, all);
  ASSERT_EQ(found.walkers.size(), 1u);
  EXPECT_TRUE(found.unexplained.empty());
  const FrameFinding& f = found.walkers.front();
  EXPECT_EQ(f.cause, "moving_target");
  EXPECT_NEAR(value(f, "x_m"), walker.x_m, 0.12);
  EXPECT_NEAR(value(f, "y_m"), walker.y_m, 0.12);
  EXPECT_NEAR(value(f, "speed_m_per_s"), walker.speed_m_per_s, 0.15);
  EXPECT_LE(interval(f, "x_m")[0], walker.x_m);
  EXPECT_GE(interval(f, "x_m")[1], walker.x_m);
  EXPECT_LE(interval(f, "speed_m_per_s")[0], walker.speed_m_per_s);
  EXPECT_GE(interval(f, "speed_m_per_s")[1], walker.speed_m_per_s);
  EXPECT_EQ(f.poses.size(), 8u);
  EXPECT_LT(f.false_alarm_rate, 1e-6);
  ASSERT_EQ(f.where.size(), 8u);
  for (const FindingPlace& place : f.where) {
    const std::size_t i = static_cast<std::size_t>(place.poses.front().back() - '0');
    const Seen seen = see(all[i], walker.x_m, walker.y_m);
    EXPECT_LT((*place.range_m)[0], seen.range_m);
    EXPECT_GT((*place.range_m)[1], seen.range_m);
    EXPECT_LT((*place.azimuth_deg)[0], seen.azimuth_rad * 180 / M_PI);
    EXPECT_GT((*place.azimuth_deg)[1], seen.azimuth_rad * 180 / M_PI);
  }
}

TEST_F(MotionLocatorTest, TellsTwoWalkersApart) {
  const Walker first{1.5, 1.0, 0.2, 0.3, 0.5}, second{-1.4, -0.8, 1.4, 0.3, 0.9};
  std::vector<PoseMotion> all = poses(8);
  for (std::size_t i = 0; i < all.size(); ++i) {
    addWalker(all[i], 7.1 * static_cast<double>(i), first, 60);
    addWalker(all[i], 7.1 * static_cast<double>(i), second, 45);
  }
  for (PoseMotion& p : all) {
    std::stable_sort(p.echoes.begin(), p.echoes.end(), [](const auto& a, const auto& b) { return a.frame < b.frame; });
  }
  const LocatedMotion found = locateMotion(radar_, all);
  ASSERT_EQ(found.walkers.size(), 2u);
  for (const Walker& w : {first, second}) {
    double nearest = 10;
    for (const FrameFinding& f : found.walkers) {
      nearest = std::min(nearest, std::hypot(value(f, "x_m") - w.x_m, value(f, "y_m") - w.y_m));
    }
    EXPECT_LT(nearest, 0.2);
  }
}

TEST_F(MotionLocatorTest, NoiseAloneMovesNothing) {
  EXPECT_TRUE(locateMotion(radar_, {}).walkers.empty());
  for (int seed = 0; seed < 5; ++seed) {
    std::vector<PoseMotion> all = poses(8);
    std::normal_distribution<float> normal;
    for (PoseMotion& p : all) {
      // Half the square of the positive part of a normal number, the law of what noise leaves in a cell.
      p.evidence = p.evidence.unaryExpr([&](float) {
        const float z = std::max(0.0f, normal(random_));
        return 0.5f * z * z;
      });
    }
    const LocatedMotion found = locateMotion(radar_, all);
    EXPECT_TRUE(found.walkers.empty());
    EXPECT_TRUE(found.unexplained.empty());
  }
}

TEST_F(MotionLocatorTest, OneCellAtEveryPoseBelongsToTheRadar) {
  const double range_m = 12 * radar_.range_bin_m(), azimuth_rad = 0, level = 40;
  std::vector<PoseMotion> all = poses(8);
  for (PoseMotion& p : all) {
    p.noise_variance = 50;
    addEvidence(p, {range_m, azimuth_rad}, 80);
    for (int f = 0; f < kFrames; ++f) {
      // A tone of amplitude A in M channels after Hann's window of N samples: A^2 M (N/2)^2 / (v 3N/8).
      const double snr = level * level * 8 * 32.0 * 32.0 / (50 * 24.0);
      p.echoes.push_back({f, range_m, azimuth_rad, snr, std::numeric_limits<double>::quiet_NaN()});
    }
  }
  const LocatedMotion found = locateMotion(radar_, all);
  EXPECT_TRUE(found.walkers.empty());
  ASSERT_EQ(found.unexplained.size(), 1u);
  const FrameFinding& f = found.unexplained.front();
  EXPECT_EQ(f.cause, "unknown");
  EXPECT_EQ(f.poses.size(), 8u);
  ASSERT_TRUE(f.mechanism);
  EXPECT_EQ(f.mechanism->mechanism, "empirical_tone");
  const double beat_hz = 2 * range_m * radar_.slope_hz_per_s / 299792458.0;
  EXPECT_NEAR(f.mechanism->values.number("beat_hz"), beat_hz, 1e-6 * beat_hz);
  EXPECT_NEAR(f.mechanism->values.number("level_db"), 20 * std::log10(level), 0.01);
  EXPECT_NEAR(f.mechanism->values.number("azimuth_deg"), 0, 1e-9);
  ASSERT_EQ(f.nats_by_pose.size(), 8u);
  for (const auto& [pose, nats] : f.nats_by_pose) EXPECT_NEAR(nats, 80, 0.01) << pose;
  // From one place nobody can tell a tone of the radar from something in the room.
  for (PoseMotion& p : all) p.pose.location = "same";
  EXPECT_TRUE(locateMotion(radar_, all).unexplained.empty());
}

TEST_F(MotionLocatorTest, LonePoseOfOneCellIsAWalkerAtThatPlace) {
  std::vector<PoseMotion> all = poses(1);
  addWalker(all[0], 0, {2.0, 0.5, 1.0, 0.3, 0.8}, 400);
  const LocatedMotion found = locateMotion(radar_, all);
  ASSERT_EQ(found.walkers.size(), 1u);
  EXPECT_NEAR(value(found.walkers[0], "x_m"), 2.0, 0.3);
  EXPECT_NEAR(value(found.walkers[0], "y_m"), 0.5, 0.3);
}

TEST_F(MotionLocatorTest, SpeedsThatFramesTellMakeOneWalkerOfEachSense) {
  std::vector<PoseMotion> all = poses(2);
  const auto echo = [&](std::size_t pose, double x_m, double y_m, double speed_m_per_s) {
    const Seen seen = see(all[pose], x_m, y_m);
    all[pose].echoes.push_back({0, seen.range_m, seen.azimuth_rad, 1000, speed_m_per_s});
  };
  // Two who pass each other, seen from both sides; a third one apart.
  for (std::size_t pose : {0u, 1u}) {
    echo(pose, 0.2, 0.1, 1.2);
    echo(pose, 0.3, 0.0, -0.8);
  }
  echo(0, -2.0, 1.5, 0.5);
  const LocatedMotion found = locateMotion(radar_, all);
  ASSERT_EQ(found.walkers.size(), 3u);
  int passing = 0;
  for (const FrameFinding& f : found.walkers) {
    const double speed = value(f, "speed_m_per_s");
    if (std::abs(speed - 0.5) < 1e-9) {
      EXPECT_NEAR(value(f, "x_m"), -2.0, 1e-6);
      EXPECT_NEAR(value(f, "y_m"), 1.5, 1e-6);
      EXPECT_EQ(f.poses, std::vector<std::string>{"p0"});
    } else {
      ++passing;
      EXPECT_EQ(f.poses.size(), 2u);
      EXPECT_NEAR(value(f, "x_m"), speed > 1 ? 0.2 : 0.3, 1e-6);
    }
    EXPECT_LT(interval(f, "speed_m_per_s")[0], speed);
    EXPECT_GT(interval(f, "speed_m_per_s")[1], speed);
  }
  EXPECT_EQ(passing, 2);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
