#include <gtest/gtest.h>

#include <cmath>

#include "mmradartwin_attribution/ros/conversions.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/ros/conversions.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {
namespace {

/// A wall of 2 m as a scan has it: each vertex some centimetres before or behind the plane.
Scene scannedWall(const FacetTolerance& tolerance) {
  constexpr int kCells = 8;
  Actor wall;
  wall.name = "wall";
  wall.material_tag = wall.material.name = "Concrete";
  for (int i = 0; i <= kCells; ++i) {
    for (int k = 0; k <= kCells; ++k) wall.vertices.push_back({0.02 * std::sin(5 * i + 3 * k), 0.25 * i, 0.25 * k});
  }
  for (int i = 0; i < kCells; ++i) {
    for (int k = 0; k < kCells; ++k) {
      const int at = i * (kCells + 1) + k;
      wall.triangles.push_back({at, at + 1, at + kCells + 2});
      wall.triangles.push_back({at, at + kCells + 2, at + kCells + 1});
    }
  }
  for (const Eigen::Vector3d& v : wall.vertices) wall.bounds.extend(v);
  Scene scene;
  scene.tolerance = tolerance;
  scene.actors.push_back(wall);
  rebuildFacets(scene);
  return scene;
}

TEST(SceneMessage, KeepsWhatIsOneFacet) {
  const Scene scan = scannedWall({35, 0.05});
  EXPECT_EQ(scan.facets.size(), 1u);
  const Scene received = sceneFromMsg(toMsg(scan, ""));
  EXPECT_EQ(received.facets.size(), 1u);
  EXPECT_NEAR(received.tolerance.angle_deg, 35, 1e-9);
  EXPECT_EQ(received.tolerance.offset_m, 0.05);
}

TEST(SceneMessage, WithoutLimitsHasTheUsualOnes) {
  mmradartwin_msgs::Scene msg = toMsg(scannedWall({35, 0.05}), "");
  msg.facet_angle_rad = msg.facet_offset_m = 0;
  EXPECT_GT(sceneFromMsg(msg).facets.size(), 50u);
  msg.facet_offset_m = 0.05;
  EXPECT_THROW(sceneFromMsg(msg), InputError);
  msg.facet_angle_rad = NAN;
  EXPECT_THROW(sceneFromMsg(msg), InputError);
}

}  // namespace
}  // namespace mmradartwin
