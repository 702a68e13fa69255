#include <algorithm>
#include <set>

#include "mmradartwin_sim/mesh_notes.h"
#include "mmradartwin_sim/moving_twin.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;

class CoincidentFaces : public SceneFiles {
 protected:
  static constexpr const char* kAll = "  specular: {}\n  corner: {}\n  diffuse: {}\n  edge_diffraction: {level: 1}\n";

  std::vector<PathRecord> paths(const std::string& scene, const std::string& mechanisms = kAll) const {
    return makeTwin(scene, mechanisms).simulate(radarPose(0, 0, 1)).records;
  }
  static double power(const std::vector<PathRecord>& records, const std::string& event) {
    double sum = 0;
    for (const PathRecord& r : records) sum += *r.event == event ? r.amplitude * r.amplitude : 0;
    return sum;
  }
  static std::set<std::string> actors(const Scene& scene, const std::vector<PathRecord>& records) {
    std::set<std::string> names;
    for (const PathRecord& r : records) {
      for (int a : r.actors) names.insert(scene.actorOf(a).name);
    }
    return names;
  }
  static std::string notes(const Scene& scene) {
    std::string all;
    for (const std::string& n : meshNotes(scene)) all += n + "\n";
    return all;
  }
  void sheet(const std::string& actor, const std::string& material, int n = 1) {
    addRectangle(actor, material, {3, -0.5, 0.6}, {0, 1, 0}, {0, 0, 0.8}, n);
  }
};

TEST_F(CoincidentFaces, OfAnObjectExportedTwiceReturnOnce) {
  for (const std::string& material : {"Metal", "RoughConcrete"}) {
    sheet("sheet", material);
    const std::vector<PathRecord> once = paths(writeScene("once"));
    sheet("sheet", material);
    sheet("sheet_001", material, 3);
    const std::string scene = writeScene("twice");
    const std::vector<PathRecord> twice = paths(scene);
    const Scene mesh = loadScene(scene, 77e9);
    ASSERT_EQ(twice.size(), once.size());
    for (std::size_t i = 0; i < once.size(); ++i) EXPECT_EQ(twice[i].amplitude, once[i].amplitude);
    EXPECT_EQ(actors(mesh, twice), std::set<std::string>{"sheet"});
    EXPECT_NE(notes(mesh).find("sheet_001 in sheet (0.8 m2)"), std::string::npos) << notes(mesh);
    if (material == "Metal") {
      EXPECT_NEAR(db(once[0].amplitude), -86.47, 0.01);
    }
  }
}

TEST_F(CoincidentFaces, OfABodyExportedTwiceReturnOnce) {
  addBox("box", "RoughMetal", {3, -0.5, 0.6}, {3.4, 0.5, 1.4});
  addSphere("ball", "RoughMetal", {2, 1, 1}, 0.2, 16, 24);
  const std::vector<PathRecord> once = paths(writeScene("once"));
  for (const std::string& copy : {"", "_001"}) {
    addBox("box" + copy, "RoughMetal", {3, -0.5, 0.6}, {3.4, 0.5, 1.4});
    addSphere("ball" + copy, "RoughMetal", {2, 1, 1}, 0.2, 16, 24);
  }
  const std::string scene = writeScene("twice");
  const std::vector<PathRecord> twice = paths(scene);
  const Scene mesh = loadScene(scene, 77e9);
  EXPECT_EQ(twice.size(), once.size());
  for (const std::string event : {"specular", "corner", "diffuse", "edge_diffraction"}) {
    EXPECT_NEAR(power(twice, event), power(once, event), 1e-9 * power(once, event)) << event;
  }
  EXPECT_EQ(actors(mesh, twice), (std::set<std::string>{"ball", "box"}));
}

// Both windings of one quadrangle are cut along different diagonals.
TEST_F(CoincidentFaces, WoundBothWaysAreOneSheet) {
  const std::vector<V> corners = {{3, -0.5, 0.6}, {3, 0.5, 0.6}, {3, 0.5, 1.4}, {3, -0.5, 1.4}};
  addPolygons("sheet", "RoughConcrete", corners, {{0, 1, 2, 3}});
  const std::vector<PathRecord> once = paths(writeScene("once"));
  addPolygons("sheet", "RoughConcrete", corners, {{0, 1, 2, 3}, {3, 2, 1, 0}});
  const std::string scene = writeScene("twice");
  const std::vector<PathRecord> twice = paths(scene);
  ASSERT_EQ(twice.size(), once.size());
  for (std::size_t i = 0; i < once.size(); ++i) EXPECT_EQ(twice[i].amplitude, once[i].amplitude);
  const Scene mesh = loadScene(scene, 77e9);
  EXPECT_NEAR(mesh.facets.at(0).area_m2, 0.8, 1e-12);
  EXPECT_NE(notes(mesh).find("sheet with itself (0.8 m2)"), std::string::npos) << notes(mesh);
  // The second side tessellated in its own way, in the same object.
  std::vector<V> more = corners;
  more.insert(more.end(), {V(3, 0, 1), V(3, 0.5, 0.9)});
  addPolygons("sheet", "RoughConcrete", more, {{0, 1, 2, 3}, {4, 1, 0}, {4, 5, 1}, {4, 2, 5}, {4, 3, 2}, {4, 0, 3}});
  EXPECT_NEAR(loadScene(writeScene("fan"), 77e9).facets.at(0).area_m2, 0.8, 1e-12);
}

// The smaller of two materials lies on top: the wall has a hole where the poster hangs.
TEST_F(CoincidentFaces, OfAPosterBelongToThePoster) {
  const auto wall = [&] { addRectangle("wall", "RoughConcrete", {3, -2, 0}, {0, 4, 0}, {0, 0, 2}, 4); };
  const auto poster = [&] { addRectangle("poster", "RoughMetal", {3, -0.4, 0.7}, {0, 0.8, 0}, {0, 0, 0.6}); };
  poster();
  const std::vector<PathRecord> alone = paths(writeScene("poster"), "  specular: {}\n");
  wall();
  const std::vector<PathRecord> bare = paths(writeScene("wall"), "  diffuse: {spacing_m: 0.05}\n");
  wall();
  poster();
  const std::string scene = writeScene("both");
  const Scene mesh = loadScene(scene, 77e9);
  const std::vector<PathRecord> both = paths(scene, "  specular: {}\n  diffuse: {spacing_m: 0.05}\n");
  ASSERT_EQ(mesh.facets.size(), 2u);
  EXPECT_NEAR(mesh.facets[0].area_m2, 8 - 0.48, 1e-9);
  EXPECT_NE(notes(mesh).find("wall in poster (0.48 m2)"), std::string::npos) << notes(mesh);
  int at_the_foot = 0;
  double wall_power = 0;
  for (const PathRecord& r : both) {
    const V& v = r.vertices[0];
    const bool on_poster = std::abs(v.y()) < 0.4 && v.z() > 0.7 && v.z() < 1.3;
    EXPECT_EQ(mesh.actorOf(r.actors[0]).name, on_poster ? "poster" : "wall");
    if (*r.event == "diffuse" && !on_poster) wall_power += r.amplitude * r.amplitude;
    if (*r.event == "specular" && std::abs(meanLength_m(r) - 6) < 1e-3) {
      ++at_the_foot;
      EXPECT_EQ(r.amplitude, alone.at(0).amplitude);
    }
  }
  EXPECT_EQ(at_the_foot, 1);
  double expected = 0;
  for (const PathRecord& r : bare) {
    const V& v = r.vertices[0];
    if (std::abs(v.y()) > 0.4 || v.z() < 0.7 || v.z() > 1.3) expected += r.amplitude * r.amplitude;
  }
  EXPECT_NEAR(10 * std::log10(wall_power / expected), 0, 0.1);
}

// Of one material the larger stays whole: what lies in it cannot be told from it.
TEST_F(CoincidentFaces, OfAWallThatTwoRoomsShareReturnAsOneWall) {
  addRectangle("long", "Concrete", {3, -3, 0}, {0, 7, 0}, {0, 0, 2});
  const std::vector<PathRecord> one = paths(writeScene("one"), "  specular: {}\n");
  addRectangle("south", "Concrete", {3, -3, 0}, {0, 4, 0}, {0, 0, 2});
  addRectangle("north", "Concrete", {3, -1, 0}, {0, 5, 0}, {0, 0, 2}, 2);
  const std::string scene = writeScene("two");
  const std::vector<PathRecord> two = paths(scene, "  specular: {}\n");
  const Scene mesh = loadScene(scene, 77e9);
  EXPECT_NEAR(mesh.facets[0].area_m2 + mesh.facets[1].area_m2, 14, 1e-9);
  EXPECT_NE(notes(mesh).find("south in north (4 m2)"), std::string::npos) << notes(mesh);
  std::complex<double> sum = 0;
  double strongest = 0;
  for (const PathRecord& r : two) {
    sum += r.c[0];
    strongest = std::max(strongest, r.amplitude);
  }
  EXPECT_NEAR(db(std::abs(sum) / std::abs(one.at(0).c[0])), 0, 0.7);
  EXPECT_NEAR(db(strongest / one.at(0).amplitude), 0, 0.7);
}

// Rooms as closed shells: from within the larger, the wall is its own and not the neighbour's too.
TEST_F(CoincidentFaces, OfRoomsThatAreShellsAreTheRoomsThatTheRadarIsIn) {
  const auto room = [&] {
    addBox("room", "Concrete", {-3, -2, 0}, {3, 2, 2.5});
    addBox("cabinet", "Metal", {2.4, 1, 0}, {3, 1.6, 1.8});  // with its back in the wall
  };
  room();
  const std::vector<PathRecord> one = paths(writeScene("one"));
  EXPECT_EQ(notes(loadScene(path("one.yaml"), 77e9)).find("coincide"), std::string::npos);
  room();
  addBox("store", "Concrete", {3, -2, 0}, {5, 2, 2.5});
  const std::string scene = writeScene("two");
  const std::vector<PathRecord> two = paths(scene);
  ASSERT_EQ(two.size(), one.size());
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(two[i].amplitude, one[i].amplitude);
  const std::string said = notes(loadScene(scene, 77e9));
  EXPECT_NE(said.find("store in room (10 m2)"), std::string::npos) << said;
  EXPECT_EQ(said.find("cabinet"), std::string::npos) << said;
}

// A wall with a thickness: the poster is a sheet on one of its faces.
TEST_F(CoincidentFaces, OfAPosterOnABlockBelongToThePoster) {
  addRectangle("poster", "Metal", {3, -0.4, 0.7}, {0, 0.8, 0}, {0, 0, 0.6});
  const std::vector<PathRecord> alone = paths(writeScene("poster"), "  specular: {}\n");
  addBox("block", "Concrete", {3, -2, 0}, {3.2, 2, 2});
  addRectangle("poster", "Metal", {3, -0.4, 0.7}, {0, 0.8, 0}, {0, 0, 0.6});
  const std::string scene = writeScene();
  const Scene mesh = loadScene(scene, 77e9);
  EXPECT_NE(notes(mesh).find("block in poster (0.48 m2)"), std::string::npos) << notes(mesh);
  int at_the_foot = 0;
  for (const PathRecord& r : paths(scene, "  specular: {}\n")) {
    if (std::abs(meanLength_m(r) - 6) > 1e-3) continue;
    ++at_the_foot;
    EXPECT_EQ(mesh.actorOf(r.actors[0]).name, "poster");
    EXPECT_EQ(r.amplitude, alone.at(0).amplitude);
  }
  EXPECT_EQ(at_the_foot, 1);
}

// Bodies that touch, and faces side by side, take nothing from each other.
TEST_F(CoincidentFaces, AreNoneWhereBodiesTouch) {
  addBox("left", "RoughMetal", {3, -0.5, 0.6}, {3.4, 0, 1.4});
  addBox("right", "RoughConcrete", {3, 0, 0.6}, {3.4, 0.5, 1.2});
  addRectangle("panel", "Metal", {3, 0.5, 0.6}, {0, 0.5, 0}, {0, 0, 0.8});
  const Scene mesh = loadScene(writeScene(), 77e9);
  EXPECT_TRUE(mesh.uncut.empty());
  EXPECT_TRUE(mesh.overlaps.empty());
  EXPECT_EQ(notes(mesh).find("coincide"), std::string::npos);
  const Scene office = loadScene(std::string(MMRADARTWIN_CONFIG) + "/office/scene.yaml", 77e9);
  EXPECT_EQ(notes(office).find("coincide"), std::string::npos) << notes(office);
}

TEST_F(CoincidentFaces, AreWholeAgainWhereTheOtherIsGone) {
  addRectangle("wall", "RoughConcrete", {3, -2, 0}, {0, 4, 0}, {0, 0, 2});
  const std::vector<PathRecord> bare = paths(writeScene("bare"));
  addRectangle("wall", "RoughConcrete", {3, -2, 0}, {0, 4, 0}, {0, 0, 2});
  addRectangle("poster", "Metal", {3, -0.4, 0.7}, {0, 0.8, 0}, {0, 0, 0.6});
  const std::string scene = writeScene("both");
  const std::vector<PathRecord> absent = paths(scene, std::string(kAll) + "  actor_absent: {actor: poster}\n");
  ASSERT_EQ(absent.size(), bare.size());
  for (std::size_t i = 0; i < bare.size(); ++i) EXPECT_EQ(absent[i].amplitude, bare[i].amplitude);
  // Carried away, and hung again.
  const Twin twin = makeTwin(scene);
  const std::vector<PathRecord> hung = twin.simulate(radarPose(0, 0, 1)).records;
  MovingTwin moving(twin, {"poster"});
  moving.place("poster", Eigen::Isometry3d(Eigen::Translation3d(-8, 0, 0)));
  const auto powerOf = [](const std::vector<PathRecord>& records) {
    double sum = 0;
    for (const PathRecord& r : records) sum += r.amplitude * r.amplitude;
    return sum;
  };
  const double bare_power = powerOf(makeTwin(path("bare.yaml")).simulate(radarPose(0, 0, 1)).records);
  EXPECT_NEAR(powerOf(moving.simulate(radarPose(0, 0, 1)).records) / bare_power, 1, 1e-9);
  moving.place("poster", Eigen::Isometry3d::Identity());
  EXPECT_NEAR(powerOf(moving.simulate(radarPose(0, 0, 1)).records) / powerOf(hung), 1, 1e-9);
}

}  // namespace
}  // namespace mmradartwin
