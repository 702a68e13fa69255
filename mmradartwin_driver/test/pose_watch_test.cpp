#include "mmradartwin_driver/pose_watch.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mmradartwin {
namespace {

using Level = PoseWatch::Level;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
std::int64_t at(double seconds) { return kStart_ns + std::llround(seconds * 1e9); }

Eigen::Isometry3d pose(double x, double turned_rad = 0) {
  return Eigen::Translation3d(x, 0.5, 1.2) * Eigen::AngleAxisd(turned_rad, Eigen::Vector3d::UnitZ());
}

/// Ten seconds at 20 Hz on a trolley that moves at walking pace.
void walk(PoseWatch& watch, double from_s, double to_s) {
  for (double t = from_s; t < to_s; t += 0.05) watch.observe(at(t), pose(0.8 * t, 0.3 * t));
}

TEST(PoseWatch, SaysThatNoPoseCame) {
  const PoseWatch watch;
  EXPECT_EQ(watch.report(at(0)).level, Level::kError);
  EXPECT_FALSE(watch.report(at(0)).age_s);
}

TEST(PoseWatch, AWalkIsFineAndItsAgeIsTold) {
  PoseWatch watch;
  walk(watch, 0, 10);
  const PoseWatch::Report report = watch.report(at(10.2));
  EXPECT_EQ(report.level, Level::kFine) << report.text;
  EXPECT_NEAR(*report.age_s, 0.25, 0.051);
  EXPECT_EQ(report.gaps + report.jumps, 0u);
}

TEST(PoseWatch, AGapIsAnErrorWhileItLastsAndAWarningAfter) {
  PoseWatch watch;
  walk(watch, 0, 5);
  EXPECT_EQ(watch.report(at(7.5)).level, Level::kError);
  EXPECT_NE(watch.report(at(7.5)).text.find("2.5 s old"), std::string::npos) << watch.report(at(7.5)).text;
  walk(watch, 8, 9);
  const PoseWatch::Report report = watch.report(at(9));
  EXPECT_EQ(report.level, Level::kWarning);
  EXPECT_NE(report.text.find("missing for 3.0 s"), std::string::npos) << report.text;
  EXPECT_EQ(report.gaps, 1u);
  EXPECT_EQ(report.jumps, 0u);  // a walk's way within the gap
  walk(watch, 9, 25);
  EXPECT_EQ(watch.report(at(25)).level, Level::kFine);
}

TEST(PoseWatch, JumpsOfPlaceAndHeading) {
  PoseWatch watch;
  watch.observe(at(0), pose(0));
  watch.observe(at(0.05), pose(1.5));
  EXPECT_EQ(watch.report(at(0.1)).level, Level::kWarning);
  EXPECT_NE(watch.report(at(0.1)).text.find("1.50 m"), std::string::npos) << watch.report(at(0.1)).text;
  watch.observe(at(0.1), pose(1.5, 1.0));
  EXPECT_EQ(watch.report(at(0.2)).jumps, 2u);
  watch.observe(at(0.15), pose(1.55, 1.05));  // noise, if fast
  EXPECT_EQ(watch.report(at(0.2)).jumps, 2u);
}

TEST(PoseWatch, AJumpAfterAGapHidesNeither) {
  PoseWatch watch;
  walk(watch, 0, 5);
  watch.observe(at(8), pose(5));
  watch.observe(at(8.05), pose(8));
  const std::string text = watch.report(at(8.1)).text;
  EXPECT_NE(text.find("were missing for"), std::string::npos) << text;
  EXPECT_NE(text.find("jumped by 3.00 m"), std::string::npos) << text;
}

TEST(PoseWatch, AStaticPoseHasNoAge) {
  PoseWatch watch;
  watch.observe(0, pose(1));
  EXPECT_EQ(watch.report(at(0)).level, Level::kFine);
  EXPECT_FALSE(watch.report(at(0)).age_s);
}

TEST(PoseWatch, AClockThatGoesBackBeginsAnew) {
  PoseWatch watch;
  walk(watch, 100, 101);
  walk(watch, 0, 1);
  EXPECT_EQ(watch.report(at(1)).level, Level::kFine);
  EXPECT_EQ(watch.report(at(1)).gaps + watch.report(at(1)).jumps, 0u);
}

}  // namespace
}  // namespace mmradartwin
