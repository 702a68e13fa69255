#include "diagnosis/report/finding_figure.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "diagnosis/survey_plan.h"
#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis {
namespace {

/// Mean place of what has a colour, NaN where nothing has.
cv::Point2d middleOf(const cv::Mat& picture, const cv::Scalar& color) {
  cv::Mat mask;
  cv::inRange(picture, color, color, mask);
  const cv::Moments m = cv::moments(mask, true);
  return {m.m10 / m.m00, m.m01 / m.m00};
}

int countOf(const cv::Mat& picture, const cv::Scalar& color) {
  cv::Mat mask;
  cv::inRange(picture, color, color, mask);
  return cv::countNonZero(mask);
}

const cv::Scalar kBlue(200, 100, 20), kRed(30, 30, 220);

SurveyPlan room() {
  SurveyPlan plan;
  plan.walls = {{"wall_south", {0, 0}, {8, 0}}, {"cabinet", {7, 3}, {7, 4}}};
  plan.stations = {{"001", {1, 1}, {1, 0}}, {"002", {1, 5}, {1, 0}}};
  return plan;
}

TEST(FindingFigure, PlacesAndPosesStandWhereTheyAreInMap) {
  Finding f;
  f.cause = "actor_unmodelled";
  f.where.emplace_back();
  f.where[0].x_m = 6;
  f.where[0].y_m = 2;
  f.where[0].poses = {"002"};
  const cv::Mat picture = drawFinding(f, room());
  // Both have the same scale: 001 stands as low as 002 stands high, the place 5 m east and 3 m south of 002.
  const cv::Point2d place = middleOf(picture, kRed), pose = middleOf(picture, kBlue);
  f.where[0].poses = {"001"};
  const cv::Point2d other = middleOf(drawFinding(f, room()), kBlue);
  const double px_per_m = (other.y - pose.y) / 4;
  ASSERT_GT(px_per_m, 10);
  EXPECT_NEAR(other.x, pose.x, 1);
  EXPECT_NEAR((place.x - pose.x) / px_per_m, 5, 0.2);  // a pose's needle points ahead
  EXPECT_NEAR((place.y - pose.y) / px_per_m, 3, 0.1);
}

TEST(FindingFigure, WhatMovedIsRedWhereItStands) {
  Finding f;
  f.cause = "actor_moved";
  f.where.emplace_back();
  f.where[0].actors = {"cabinet"};
  const auto movedBy = [&](double dx_m) {
    Parameters values;
    values.set("actor", std::string("cabinet"));
    values.set("dx_m", dx_m);
    values.set("dy_m", 0.0);
    values.set("dyaw_deg", 90.0);
    f.mechanism = NamedParameters{"actor_moved", values};
    f.where[0].x_m = 7 + dx_m;
    f.where[0].y_m = 3.5;
    return middleOf(drawFinding(f, room()), kRed);
  };
  const cv::Point2d one = movedBy(-1), three = movedBy(-3);
  f.where[0].poses = {"001"};
  const double south_px = middleOf(drawFinding(f, room()), kBlue).y;
  f.where[0].poses = {"002"};
  const double px_per_m = (south_px - middleOf(drawFinding(f, room()), kBlue).y) / 4;
  EXPECT_NEAR((one.x - three.x) / px_per_m, 2, 0.05);
  EXPECT_NEAR(one.y, three.y, 1);
}

TEST(FindingFigure, WhatItIsAboutIsRed) {
  Finding f;
  f.cause = "actor_absent";
  EXPECT_EQ(countOf(drawFinding(f, room()), kRed), 0);
  f.where.emplace_back();
  f.where[0].actors = {"cabinet"};
  EXPECT_GT(countOf(drawFinding(f, room()), kRed), 20);
  f.where.clear();
  f.parameters = {{"actor", "1", std::string("cabinet"), {}}};
  EXPECT_GT(countOf(drawFinding(f, room()), kRed), 20);
}

TEST(FindingFigure, MapsStandBesideThePlan) {
  Finding f;
  f.cause = "range_bias";
  const cv::Mat plan = drawFinding(f, room());
  auto maps = std::make_shared<FindingMaps>();
  maps->axes = SignalChain(paperRadar()).axes();
  maps->before_db = maps->after_db =
      RealGrid::Constant(static_cast<Eigen::Index>(maps->axes.range_m.size()), kAngleBins, 10.0);
  maps->after_db.setZero();
  f.maps = maps;
  const cv::Mat all = drawFinding(f, room());
  EXPECT_EQ(all.rows, plan.rows);
  ASSERT_GT(all.cols, 2 * plan.rows + plan.cols);
  // What is simulated too strong is red before, and white after.
  const int fan = (all.cols - plan.cols) / 2;
  const cv::Vec3b before = all.at<cv::Vec3b>(all.rows / 2, fan * 43 / 100),
                  after = all.at<cv::Vec3b>(all.rows / 2, fan + fan * 43 / 100);
  EXPECT_GT(before[2], before[0] + 60);
  EXPECT_NEAR(after[2], after[0], 25);
}

TEST(FindingFigure, ARecordingWithoutASceneHasItsPosesAlone) {
  Pose pose;
  pose.name = "001";
  const SurveyPlan plan = surveyPlan(nullptr, {pose});
  EXPECT_TRUE(plan.walls.empty());
  Finding f;
  f.cause = "packet_loss";
  f.where.emplace_back();
  f.where[0].poses = {"001"};
  EXPECT_GT(countOf(drawFinding(f, plan), kBlue), 10);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
