#include "mmradartwin_attribution/pose_picture.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "synthetic_map.h"

namespace mmradartwin {
namespace {

using synthetic::kDegree;

/// Pixels of a colour, edges of lines blended with what is below them apart.
cv::Mat maskOf(const cv::Mat& picture, const cv::Scalar& color, double tolerance = 0) {
  cv::Mat mask;
  cv::inRange(picture, color - cv::Scalar::all(tolerance), color + cv::Scalar::all(tolerance), mask);
  return mask;
}

int countOf(const cv::Mat& picture, const cv::Scalar& color, double tolerance = 0) {
  return cv::countNonZero(maskOf(picture, color, tolerance));
}

cv::Rect boundsOf(const cv::Mat& picture, const cv::Scalar& color, double tolerance = 0) {
  return cv::boundingRect(maskOf(picture, color, tolerance));
}

const cv::Scalar kMagenta(255, 0, 255);

/// An echo at 5 m and 30 deg to the left beside one at 3 m ahead that both branches have.
class PosePicture : public ::testing::Test {
 protected:
  PoseResult compare(bool measured, bool simulated) const {
    const std::vector<synthetic::Target> both = {{3, 0, 0}, {5, 30, -5}}, alone = {{3, 0, 0}};
    ResponseRegion anchor, tv;
    anchor.range_m = 3;
    anchor.actor = "anchor";
    tv.range_m = 5;
    tv.azimuth_rad = 30 * kDegree;
    tv.actor = "tv";
    PoseResult result;
    result.pose.name = "012";
    result.attribution = attributePose(field_, synthetic::map(radar_, measured ? both : alone),
                                       synthetic::map(radar_, simulated ? both : alone), {anchor, tv}, {});
    return result;
  }
  /// Columns of one of the three fans.
  static cv::Mat fan(const cv::Mat& picture, int index) {
    return picture.colRange(index * picture.cols / 3, (index + 1) * picture.cols / 3);
  }

  RadarConfig radar_ = paperRadar();
  EvaluationField field_{AttributionConfig(), radar_, SignalChain(radar_).axes()};
};

TEST_F(PosePicture, ResidualsStandInMagentaOnTheStrongerBranch) {
  const cv::Mat agreed = drawPose(field_, compare(true, true));
  EXPECT_EQ(countOf(agreed, kMagenta, 60), 0);
  const cv::Mat missing = drawPose(field_, compare(true, false));
  EXPECT_GT(countOf(fan(missing, 0), kMagenta, 60), 50);
  EXPECT_EQ(countOf(fan(missing, 1), kMagenta, 60), 0);
  const cv::Mat extra = drawPose(field_, compare(false, true));
  EXPECT_EQ(countOf(fan(extra, 0), kMagenta, 60), 0);
  EXPECT_GT(countOf(fan(extra, 1), kMagenta, 60), 50);
  EXPECT_EQ(countOf(fan(extra, 2), kMagenta, 60), 0);
}

// Left of the radar is left in the picture, above is ahead.
TEST_F(PosePicture, ABoxStandsWhereItsResidualIs) {
  const cv::Mat picture = fan(drawPose(field_, compare(true, false)), 0);
  const cv::Rect box = boundsOf(picture, kMagenta, 60);
  EXPECT_LT(box.x + box.width / 2, picture.cols / 2);
  EXPECT_GT(box.y, 40);
}

TEST_F(PosePicture, TheListNamesEachResidualInTheColourOfItsClass) {
  const PoseResult missing = compare(true, false);
  ASSERT_EQ(missing.attribution.residuals.size(), 1u);
  ASSERT_EQ(missing.attribution.residuals[0].residual_class, ResidualClass::kMissingSupport);
  const cv::Mat picture = drawPose(field_, missing), agreed = drawPose(field_, compare(true, true));
  EXPECT_GT(countOf(picture, classColor_bgr(ResidualClass::kMissingSupport)), 80);
  EXPECT_EQ(countOf(agreed, classColor_bgr(ResidualClass::kMissingSupport)), 0);
  EXPECT_GT(picture.rows, agreed.rows);
}

TEST_F(PosePicture, ALongListIsCutAfterEight) {
  PoseResult result = compare(true, false);
  const Residual one = result.attribution.residuals.front();
  result.attribution.residuals.assign(8, one);
  const int rows = drawPose(field_, result).rows;
  result.attribution.residuals.assign(9, one);
  const int more = drawPose(field_, result).rows;
  EXPECT_GT(more, rows);  // a line that says how many more
  result.attribution.residuals.assign(30, one);
  EXPECT_EQ(drawPose(field_, result).rows, more);
}

/// A floor and a ceiling of 8 x 4 m and a wall along y = 0.
Scene room() {
  Scene scene;
  const auto add = [&scene](const std::string& name, const std::array<float, 3>& color,
                            const std::vector<Eigen::Vector3d>& corners) {
    Actor actor;
    actor.name = name;
    actor.material_tag = name + "_material";
    actor.material.color = {color[0], color[1], color[2]};
    actor.vertices = corners;
    actor.triangles = {{0, 1, 2}, {0, 2, 3}};
    for (const Eigen::Vector3d& v : corners) actor.bounds.extend(v);
    scene.actors.push_back(actor);
  };
  add("floor", {0, 1, 0}, {{0, 0, 0}, {8, 0, 0}, {8, 4, 0}, {0, 4, 0}});
  add("ceiling", {0, 0, 1}, {{0, 0, 3}, {8, 0, 3}, {8, 4, 3}, {0, 4, 3}});
  add("wall", {1, 0, 0}, {{0, 0, 0}, {8, 0, 0}, {8, 0, 3}, {0, 0, 3}});
  return scene;
}

const cv::Scalar kRadarBlue(178, 114, 0);

TEST(CoveragePicture, HidesTheCeilingAndDrawsWallsAsLines) {
  const cv::Mat picture = drawCoverage(room(), {});
  const cv::Scalar floor(166, 255, 166);  // 0.35 of the colour over white
  EXPECT_GT(countOf(picture, floor), picture.rows * picture.cols / 4);
  EXPECT_EQ(countOf(picture, cv::Scalar(255, 166, 166)), 0);  // the ceiling
  const cv::Rect wall = boundsOf(picture, cv::Scalar(0, 0, 179), 30), ground = boundsOf(picture, floor);
  EXPECT_GT(wall.width, 0.9 * ground.width);
  EXPECT_LT(wall.height, 10);
  EXPECT_GT(wall.y, ground.y + ground.height / 2);  // y points up
  // Both sides have the same scale.
  EXPECT_NEAR(static_cast<double>(ground.width) / ground.height, 2, 0.05);
}

TEST(CoveragePicture, PosesStandWhereTheyAreAndLookAsTheyDo) {
  Pose pose;
  pose.name = pose.location = "1";
  pose.T_map_radar = Eigen::Isometry3d(Eigen::Translation3d(2, 1, 1));
  const cv::Rect east = boundsOf(drawCoverage(room(), {pose}).colRange(0, 900), kRadarBlue);
  pose.T_map_radar = Eigen::Translation3d(2, 1, 1) * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ());
  const cv::Rect west = boundsOf(drawCoverage(room(), {pose}).colRange(0, 900), kRadarBlue);
  pose.T_map_radar = Eigen::Translation3d(4, 1, 1) * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ());
  const cv::Rect farther = boundsOf(drawCoverage(room(), {pose}).colRange(0, 900), kRadarBlue);
  ASSERT_GT(east.width, 5);
  const double px_per_m = 900.0 / 8;
  EXPECT_NEAR(farther.x - west.x, 2 * px_per_m, 2);
  EXPECT_LT(west.x, east.x - 0.2 * px_per_m);
  EXPECT_GT(east.x + east.width, west.x + west.width + 0.2 * px_per_m);
}

TEST(ClassColours, StayApart) {
  for (int a = 1; a <= 5; ++a) {
    for (int b = a + 1; b <= 5; ++b) {
      EXPECT_GT(cv::norm(classColor_bgr(static_cast<ResidualClass>(a)), classColor_bgr(static_cast<ResidualClass>(b))),
                60);
    }
  }
}

}  // namespace
}  // namespace mmradartwin
