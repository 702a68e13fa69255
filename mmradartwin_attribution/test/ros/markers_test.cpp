#include "mmradartwin_attribution/ros/markers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

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
TEST(FindingMarkers, NamesOfOnePlaceStandOverEachOther) {
  Findings findings;
  for (const char* cause : {"material_reflectivity", "actor_moved"}) {
    Finding finding;
    finding.cause = cause;
    FindingPlace place;
    place.x_m = 4;
    place.y_m = 3;
    finding.where.push_back(place);
    findings.findings.push_back(finding);
  }
  std::vector<const Marker*> labels;
  const auto shown = findingMarkers(findings, "map");
  for (const Marker& m : shown.markers) {
    if (m.type == Marker::TEXT_VIEW_FACING && m.action == Marker::ADD) labels.push_back(&m);
  }
  ASSERT_EQ(labels.size(), 2u);
  EXPECT_GE(labels[1]->pose.position.z - labels[0]->pose.position.z, labels[0]->scale.z);
}

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
};

TEST_F(PoseMarkers, BoxesLieOnTheFloorWhereMapsAgreeAndDiffer) {
  MarkerBuilder builder(field_, "map");
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(1, 2, 1.2);
  T.rotate(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  const auto markers = builder.build(pose(false), {}, T, "1");
  // The echo at 5 m and 30 degrees has no support in the twin, that at 3 m is in both.
  for (const auto& [ns, range_m, azimuth_deg] : {std::tuple{"C1", 5.0, 30.0}, std::tuple{"matched", 3.0, 0.0}}) {
    const auto boxes = named(markers, ns);
    ASSERT_EQ(boxes.size(), 2u) << ns;
    for (const Marker& box : boxes) {
      EXPECT_EQ(box.header.frame_id, "map");
      double x = 0, y = 0;
      for (const auto& p : box.points) {
        x += p.x / static_cast<double>(box.points.size());
        y += p.y / static_cast<double>(box.points.size());
        EXPECT_NEAR(p.z, 0.04, 0.02);
      }
      EXPECT_NEAR(std::hypot(x - 1, y - 2), range_m, 0.15) << ns;
      EXPECT_NEAR(std::atan2(y - 2, x - 1) / synthetic::kDegree, 90 + azimuth_deg, 1) << ns;
    }
    // A dark rim, wider and below the line.
    EXPECT_EQ(boxes[0].color.r + boxes[0].color.g + boxes[0].color.b, 0);
    EXPECT_GT(boxes[0].scale.x, 2 * boxes[1].scale.x);
    EXPECT_LT(boxes[0].points[0].z, boxes[1].points[0].z);
  }
  EXPECT_TRUE(named(markers, "C2").empty());
}

TEST_F(PoseMarkers, WhatAPoseNoLongerHasIsDeletedById) {
  MarkerBuilder builder(field_);
  const auto first = builder.build(pose(false), {}, Eigen::Isometry3d::Identity(), "1");
  EXPECT_EQ(first.markers.front().action, Marker::DELETEALL);
  const auto second = builder.build(pose(true), {}, Eigen::Isometry3d::Identity(), "2");
  std::map<std::pair<std::string, int>, bool> deleted;
  for (const Marker& m : second.markers) {
    EXPECT_NE(m.action, Marker::DELETEALL);
    if (m.action == Marker::DELETE) deleted[{m.ns, m.id}] = true;
  }
  for (const Marker& m : first.markers) {
    if (m.ns != "C1" || m.action != Marker::ADD) continue;
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
  MarkerBuilder builder(field_, "map", 2);
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
  EXPECT_NEAR(markers[0].color.g, 0.35 + 0.65 * 0.4, 1e-6);  // lighter than the material
}

}  // namespace
}  // namespace mmradartwin
