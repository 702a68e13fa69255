#include <algorithm>

#include "mmradartwin_sim/seen_sides.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;

class ThinBodies : public SceneFiles {
 protected:
  /// A scene's paths from 1 m over the ground, along x.
  std::vector<PathRecord> paths(const std::string& scene, const std::string& mechanisms = "") const {
    return makeTwin(scene, mechanisms).simulate(radarPose(0, 0, 1)).records;
  }
  static std::string turned(double yaw_deg) {
    return ", xyz_m: [3, 0, 0], rpy_deg: [0, 0, " + std::to_string(yaw_deg) + "]";
  }
  static bool within(const V& p, const V& low, const V& high) { return Eigen::AlignedBox3d(low, high).contains(p); }
};

// The front is a sheet of 1.0 x 0.8 m; what lies behind it adds nothing, however near.
TEST_F(ThinBodies, ReturnAsTheirFrontAloneDoes) {
  for (double yaw_deg : {0.0, 20.0}) {
    addRectangle("sheet", "Metal", {0, -0.5, 0.6}, {0, 1, 0}, {0, 0, 0.8});
    const std::vector<PathRecord> sheet = paths(writeScene("sheet", turned(yaw_deg)));
    ASSERT_EQ(sheet.size(), 1u);
    EXPECT_NEAR(db(sheet[0].amplitude), yaw_deg == 0 ? -86.47 : -118.65, 0.01);
    for (double t_mm : {0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 10.0}) {
      addBox("box", "Metal", {0, -0.5, 0.6}, {t_mm * 1e-3, 0.5, 1.4});
      const std::vector<PathRecord> box = paths(writeScene("box", turned(yaw_deg)));
      ASSERT_EQ(box.size(), 1u) << t_mm << " mm at " << yaw_deg << " deg";
      EXPECT_NEAR(meanLength_m(box[0]), meanLength_m(sheet[0]), 1e-9) << t_mm << " mm";
      EXPECT_NEAR(box[0].amplitude / sheet[0].amplitude, 1, 1e-9) << t_mm << " mm at " << yaw_deg << " deg";
    }
  }
}

// A rod of half a millimetre: the far side's points are nearer to the front than a ray ends short of them.
TEST_F(ThinBodies, ScatterFromTheirNearSideAlone) {
  addCylinder("rod", "RoughMetal", {3, 0, 0.5}, {3, 0, 1.5}, 0.25e-3, 8);
  const std::string scene = writeScene();
  const std::vector<PathRecord> seen = paths(scene, "  diffuse: {spacing_m: 0.02}\n");
  const Scene mesh = loadScene(scene, 77e9);
  ASSERT_EQ(mesh.bodies.size(), 1u);
  EXPECT_GT(seen.size(), 50u);
  for (const PathRecord& r : seen) {
    const Facet& f = mesh.facets[static_cast<std::size_t>(r.facets[0])];
    EXPECT_GT(f.outside * f.planeDistance(V(0, 0, 1)), 0) << r.vertices[0].transpose();
  }
}

// A pane of glass before a wall, and a plate within a cabinet of sheet metal.
TEST_F(ThinBodies, HideWhatLiesMillimetresBehindThem) {
  addRectangle("wall", "RoughConcrete", {3, -2, 0}, {0, 4, 0}, {0, 0, 2});
  addBox("pane", "Lossless", {2.9990, -0.6, 0.4}, {2.9996, 0.6, 1.6});
  for (const PathRecord& r : paths(writeScene("pane"))) {
    const V& v = r.vertices[0];
    const bool behind = v.x() > 2.9993 && within(v, {2.9, -0.599, 0.401}, {3.1, 0.599, 1.599});
    EXPECT_FALSE(behind) << *r.event << " at " << v.transpose();
  }
  addBox("cabinet", "Metal", {3, -0.5, 0.6}, {3.002, 0.5, 1.4});
  addRectangle("plate", "RoughMetal", {3.0006, -0.4, 0.7}, {0, 0.8, 0}, {0, 0, 0.6});
  const std::vector<PathRecord> cabinet = paths(writeScene("cabinet"));
  ASSERT_EQ(cabinet.size(), 1u);
  EXPECT_NEAR(db(cabinet[0].amplitude), -86.47, 0.01);
}

// From within, a closed shell is a room, and its outside is never seen.
TEST_F(ThinBodies, AreSeenFromWithinByARadarInThem) {
  addBox("room", "Metal", {-1, -2, 0}, {4, 2, 2.5});
  const std::string scene = writeScene();
  const Scene mesh = loadScene(scene, 77e9);
  const SeenSides within(mesh, V(0, 0, 1)), before(mesh, V(-3, 0, 1));
  ASSERT_EQ(mesh.bodies.size(), 1u);
  EXPECT_TRUE(isWithin(mesh, mesh.bodies[0], V(3.999, 1.999, 2.499)));
  EXPECT_FALSE(isWithin(mesh, mesh.bodies[0], V(4.001, 0, 1)));
  int seen_from_before = 0;
  for (const Facet& f : mesh.facets) {
    EXPECT_TRUE(within.shows(f, V(0, 0, 1)));
    seen_from_before += before.shows(f, V(-3, 0, 1));
  }
  EXPECT_EQ(seen_from_before, 1);
  EXPECT_EQ(of(makeTwin(scene).simulate(radarPose(0, 0, 1)), "specular", 1).size(), 1u);
}

// Winding means nothing; a missing face, or an edge of three faces, leaves no body.
TEST_F(ThinBodies, AreClosedWhereEachEdgeJoinsTwoTriangles) {
  const std::vector<V> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<std::vector<int>> faces = {{0, 1, 2}, {0, 3, 1}, {2, 0, 3}, {1, 3, 2}};
  addPolygons("whole", "Metal", corners, faces);
  const Scene whole = loadScene(writeScene(), 77e9);
  ASSERT_EQ(whole.bodies.size(), 1u);
  for (const Facet& f : whole.facets) EXPECT_LT(f.outside * f.planeDistance(V(0.2, 0.2, 0.2)), 0);
  addPolygons("open", "Metal", corners, {faces[0], faces[1], faces[2]});
  EXPECT_TRUE(loadScene(writeScene(), 77e9).bodies.empty());
  std::vector<V> fin = corners;
  fin.emplace_back(2, 2, 2);
  addPolygons("fin", "Metal", fin, {faces[0], faces[1], faces[2], faces[3], {1, 2, 4}});
  EXPECT_TRUE(loadScene(writeScene(), 77e9).bodies.empty());
}

}  // namespace
}  // namespace mmradartwin
