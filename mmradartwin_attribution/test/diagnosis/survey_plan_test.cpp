#include "diagnosis/survey_plan.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mmradartwin::diagnosis {
namespace {

Actor actorOf(const std::string& name, std::vector<Eigen::Vector3d> vertices,
              std::vector<std::array<int, 3>> triangles) {
  Actor actor;
  actor.name = name;
  actor.vertices = std::move(vertices);
  actor.triangles = std::move(triangles);
  return actor;
}

TEST(SurveyPlan, AWallSeenFromAboveIsOneLinePerTriangle) {
  Scene scene;
  scene.actors = {actorOf("wall", {{0, 0, 0}, {4, 3, 0}, {4, 3, 2.5}, {0, 0, 2.5}}, {{0, 1, 2}, {0, 2, 3}})};
  const SurveyPlan plan = surveyPlan(&scene, {});
  ASSERT_EQ(plan.walls.size(), 2u);
  for (const SurveyPlan::Wall& wall : plan.walls) {
    EXPECT_EQ(wall.actor, "wall");
    EXPECT_NEAR((wall.to_m - wall.from_m).norm(), 5, 1e-12);
  }
}

// 45 deg of slope is the limit: sin 45 = 0.707.
TEST(SurveyPlan, WhatLiesFlatIsLeftOut) {
  const auto sloped = [](double slope_deg) {
    Scene scene;
    const double slope = slope_deg * M_PI / 180;
    scene.actors = {actorOf("ramp", {{0, 0, 0}, {1, 0, 0}, {0, std::cos(slope), std::sin(slope)}}, {{0, 1, 2}})};
    return surveyPlan(&scene, {}).walls.size();
  };
  EXPECT_EQ(sloped(0), 0u);
  EXPECT_EQ(sloped(40), 0u);
  EXPECT_EQ(sloped(50), 1u);
  EXPECT_EQ(sloped(90), 1u);
}

TEST(SurveyPlan, StationsStandAndLookAsTheRadarsDo) {
  Pose pose;
  pose.name = "007";
  pose.T_map_radar = Eigen::Translation3d(1, 2, 1.5) * Eigen::AngleAxisd(M_PI / 6, Eigen::Vector3d::UnitZ());
  const SurveyPlan plan = surveyPlan(nullptr, {pose});
  EXPECT_TRUE(plan.walls.empty());
  ASSERT_EQ(plan.stations.size(), 1u);
  EXPECT_EQ(plan.stations[0].pose, "007");
  EXPECT_TRUE(plan.stations[0].at_m.isApprox(Eigen::Vector2d(1, 2), 1e-12));
  EXPECT_TRUE(plan.stations[0].boresight.isApprox(Eigen::Vector2d(std::sqrt(0.75), 0.5), 1e-12));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
