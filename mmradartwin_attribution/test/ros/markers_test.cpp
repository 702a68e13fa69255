#include "mmradartwin_attribution/ros/markers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "synthetic_map.h"

namespace mmradartwin {
namespace {

using visualization_msgs::Marker;

TEST(FindingMarkers, ARingAsWideAsTheIntervalStandsWhereTheFindingIs) {
  Finding f;
  f.cause = "actor_moved";
  f.parameters = {{"dx_m", "m", 0.2, {{0.0, 0.8}}}, {"dy_m", "m", 0.1, {{0.09, 0.11}}}};
  f.where.resize(2);  // the second has no place
  f.where[0].actors = {"cabinet"};
  f.where[0].x_m = 3;
  f.where[0].y_m = -1;
  Findings findings;
  findings.findings = {f};
  const visualization_msgs::MarkerArray shown = findingMarkers(findings, "map");
  ASSERT_EQ(shown.markers.size(), 3u);
  EXPECT_EQ(shown.markers[0].action, Marker::DELETEALL);  // what an earlier diagnosis had found
  const Marker &ring = shown.markers[1], &label = shown.markers[2];
  double most_x = 0, most_y = 0;
  for (const geometry_msgs::Point& p : ring.points) {
    most_x = std::max(most_x, std::abs(p.x - 3));
    most_y = std::max(most_y, std::abs(p.y + 1));
  }
  EXPECT_NEAR(most_x, 0.4, 1e-9);
  EXPECT_NEAR(most_y, 0.15, 1e-9);  // narrower could not be seen
  EXPECT_EQ(ring.header.frame_id, "map");
  EXPECT_EQ(label.text, "actor_moved cabinet");
  EXPECT_NEAR(label.pose.position.x, 3, 1e-9);
}

TEST(FindingMarkers, NothingIsShownOfFindingsWithoutAPlace) {
  Findings findings;
  findings.findings.resize(1);
  findings.findings[0].where.emplace_back();
  EXPECT_EQ(findingMarkers(findings, "map").markers.size(), 1u);
}

/// One pose whose echo at 5 m and 30 deg is measured alone, beside one at 3 m that both branches have.
class PoseMarkers : public ::testing::Test {
 protected:
  static ResponseRegion region(const std::string& actor, double range_m, double azimuth_deg) {
    ResponseRegion r;
    r.actor = actor;
    r.range_m = range_m;
    r.azimuth_rad = azimuth_deg * synthetic::kDegree;
    return r;
  }
  PoseAttribution pose(bool simulated) const {
    const std::vector<synthetic::Target> both = {{3, 0, 0}, {5, 30, -5}}, alone = {{3, 0, 0}};
    return attributePose(field_, synthetic::map(radar_, both), synthetic::map(radar_, simulated ? both : alone),
                         {region("wall", 3, 0), region("tv;shelf", 5, 30)}, {});
  }
  static std::vector<Marker> named(const visualization_msgs::MarkerArray& array, const std::string& ns) {
    std::vector<Marker> found;
    for (const Marker& m : array.markers) {
      if (m.ns == ns && m.action == Marker::ADD) found.push_back(m);
    }
    return found;
  }

  RadarConfig radar_ = paperRadar();
  EvaluationField field_{AttributionConfig(), radar_, SignalChain(radar_).axes()};
  MarkerFrames frames_;
};

TEST_F(PoseMarkers, AFanCoversItsHalfDiscWithTwoTrianglesACell) {
  MarkerBuilder builder(field_, frames_);
  const auto fans = named(builder.build(pose(false), {}, Eigen::Isometry3d::Identity(), "1"), "measured");
  ASSERT_EQ(fans.size(), 1u);
  const Marker& fan = fans[0];
  EXPECT_EQ(fan.header.frame_id, frames_.measured);
  ASSERT_EQ(fan.points.size(), 3 * fan.colors.size());
  double area_m2 = 0, farthest_m = 0;
  for (std::size_t i = 0; i < fan.points.size(); i += 3) {
    const auto &a = fan.points[i], &b = fan.points[i + 1], &c = fan.points[i + 2];
    area_m2 += 0.5 * std::abs((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
    farthest_m = std::max(farthest_m, std::hypot(b.x, b.y));
  }
  // From half a bin to the end; chords lose a little of the arcs, and the outermost bins are not drawn.
  const double expected_m2 = M_PI / 2 * farthest_m * farthest_m;
  EXPECT_GT(area_m2, 0.8 * expected_m2);
  EXPECT_LT(area_m2, expected_m2);
}

TEST_F(PoseMarkers, TheBrightestCellOfAFanIsTheStrongestEcho) {
  MarkerBuilder builder(field_, frames_);
  const auto fan = named(builder.build(pose(false), {}, Eigen::Isometry3d::Identity(), "1"), "measured").at(0);
  // Viridis ends in yellow: the cell with the most red and green is the strongest.
  std::size_t brightest = 0;
  const auto light = [&](std::size_t i) { return fan.colors[i].r + fan.colors[i].g; };
  for (std::size_t i = 0; i < fan.colors.size(); ++i) brightest = light(i) > light(brightest) ? i : brightest;
  const auto& corner = fan.points[3 * brightest];
  EXPECT_NEAR(std::hypot(corner.x, corner.y), 3, 0.2);
  EXPECT_NEAR(std::atan2(corner.y, corner.x), 0, 0.06);
}

TEST_F(PoseMarkers, AResidualHasABoxAndALabelOnTheStrongerBranch) {
  MarkerBuilder builder(field_, frames_);
  const auto markers = builder.build(pose(false), {}, Eigen::Isometry3d::Identity(), "1");
  const auto boxes = named(markers, "mismatch");
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_EQ(boxes[0].header.frame_id, frames_.measured);
  double x = 0, y = 0;
  for (const auto& p : boxes[0].points) {
    x += p.x / static_cast<double>(boxes[0].points.size());
    y += p.y / static_cast<double>(boxes[0].points.size());
  }
  EXPECT_NEAR(std::hypot(x, y), 5, 0.15);
  EXPECT_NEAR(std::atan2(y, x) / synthetic::kDegree, 30, 1);
  const auto labels = named(markers, "C1");
  ASSERT_EQ(labels.size(), 2u);  // and its shadow
  EXPECT_EQ(labels[1].text.find("C1 missing support: tv+shelf -"), 0u) << labels[1].text;
  EXPECT_EQ(named(markers, "matched").size(), 2u);
}

TEST_F(PoseMarkers, WhatAPoseNoLongerHasIsDeletedById) {
  MarkerBuilder builder(field_, frames_);
  const auto first = builder.build(pose(false), {}, Eigen::Isometry3d::Identity(), "1");
  EXPECT_EQ(first.markers.front().action, Marker::DELETEALL);
  const auto second = builder.build(pose(true), {}, Eigen::Isometry3d::Identity(), "2");
  std::map<std::pair<std::string, int>, bool> deleted;
  for (const Marker& m : second.markers) {
    EXPECT_NE(m.action, Marker::DELETEALL);
    if (m.action == Marker::DELETE) deleted[{m.ns, m.id}] = true;
  }
  for (const Marker& m : first.markers) {
    if (m.ns != "C1" && m.ns != "mismatch") continue;
    EXPECT_TRUE((deleted[{m.ns, m.id}])) << m.ns << " " << m.id;
  }
}

TEST_F(PoseMarkers, TheStrongestPathsAreDrawnVertexByVertex) {
  const std::string specular = "specular", corner = "corner";
  PathRecord strong, weak, weakest;
  strong.event = &corner;
  strong.amplitude = 1;
  strong.vertices = {{4, 1, 0}, {4, 2, 0}};
  weak.event = &specular;
  weak.amplitude = 0.1;
  weak.vertices = {{3, 0, 0}};
  weakest = weak;
  weakest.amplitude = 0.01;
  MarkerBuilder builder(field_, frames_, {2, 0, 30});
  const Eigen::Isometry3d T(Eigen::Translation3d(1, 0, 0));
  const auto markers = builder.build(pose(true), {weakest, weak, strong}, T, "1");
  const auto corners = named(markers, "paths corner"), speculars = named(markers, "paths specular");
  ASSERT_EQ(corners.size(), 1u);
  ASSERT_EQ(speculars.size(), 1u);
  ASSERT_EQ(corners[0].points.size(), 6u);  // out, across, back
  EXPECT_EQ(corners[0].points.front().x, 1);
  EXPECT_EQ(corners[0].points[2].y, 1);
  EXPECT_EQ(corners[0].points.back().x, 1);
  ASSERT_EQ(speculars[0].points.size(), 2u);  // one of the two, out and back on one line
  EXPECT_NEAR(corners[0].colors[0].a, 1, 1e-6);
  EXPECT_NEAR(speculars[0].colors[0].a, 0.5, 1e-6);  // 20 dB of 40
}

TEST(SceneMarkers, LevelSurfacesAreApartAndCeilingsAreNotShown) {
  Scene scene;
  const auto add = [&scene](const std::string& material, const std::vector<Eigen::Vector3d>& corners) {
    Actor actor;
    actor.material_tag = material;
    actor.material.color = {0.2, 0.4, 0.6};
    actor.vertices = corners;
    actor.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.actors.push_back(actor);
  };
  add("Concrete", {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}});
  add("Concrete", {{0, 0, 3}, {4, 0, 3}, {4, 4, 3}, {0, 4, 3}});
  add("Concrete", {{0, 0, 0}, {4, 0, 0}, {4, 0, 3}, {0, 0, 3}});
  const auto markers = sceneMarkers(scene, "map").markers;
  ASSERT_EQ(markers.size(), 2u);
  EXPECT_EQ(markers[0].ns, "Concrete");
  EXPECT_EQ(markers[1].ns, "Concrete level");
  EXPECT_EQ(markers[0].points.size(), 6u);
  ASSERT_EQ(markers[1].points.size(), 6u);
  for (const auto& p : markers[1].points) EXPECT_EQ(p.z, 0);
  EXPECT_GT(markers[0].color.a, markers[1].color.a);
  EXPECT_NEAR(markers[0].color.g, 0.4, 1e-6);
}

}  // namespace
}  // namespace mmradartwin
