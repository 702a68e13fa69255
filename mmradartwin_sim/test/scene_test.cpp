#include <cstdlib>
#include <map>
#include <random>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/mesh_notes.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;

class SceneTest : public SceneFiles {
 protected:
  static constexpr double kFrequency_hz = 77.93e9;
  std::string sceneError(const std::string& file) {
    return errorOf([&] { loadScene(file, kFrequency_hz); });
  }
};

TEST_F(SceneTest, TakesObjectsAsActorsAndMaterialNamesAsTags) {
  addWall("wall", "Concrete", {3, -2}, {3, 2});
  addBox("cabinet", "Metal", V(1, 1, 0), V(1.5, 1.5, 1));
  const Scene scene = loadScene(writeScene(), kFrequency_hz);
  ASSERT_EQ(scene.actors.size(), 2u);
  EXPECT_EQ(scene.actors[0].name, "wall");
  EXPECT_EQ(scene.actors[0].material_tag, "Concrete");
  EXPECT_EQ(scene.actors[1].name, "cabinet");
  EXPECT_EQ(scene.actors[1].material.model, MaterialModel::kConductor);
  EXPECT_EQ(scene.actors[1].facets.size(), 6u);
  int reflecting = 0;
  for (int id : scene.actors[1].facets) reflecting += scene.facets[id].reflects;
  EXPECT_EQ(reflecting, 4) << "top and bottom only occlude";
}

TEST_F(SceneTest, KeepsTheFilesDigits) {
  addWall("wall", "Concrete", {100.123456789, -2}, {100.123456789, 2});
  const Scene scene = loadScene(writeScene(), kFrequency_hz);
  EXPECT_NEAR(scene.actors[0].vertices[0].x(), 100.123456789, 1e-12);
}

TEST_F(SceneTest, PlacesMeshesByScaleThenRotationThenShift) {
  addWall("wall", "Concrete", {1, 0}, {1, 1}, 0, 1);
  const std::string file = writeScene("placed", ", xyz_m: [10, 20, 30], rpy_deg: [90, 0, 90], scale: 2");
  // (1,0,0) -> scaled (2,0,0) -> Rx keeps it -> Rz(90) (0,2,0) -> shifted.
  EXPECT_LT((loadScene(file, kFrequency_hz).actors[0].vertices[0] - V(10, 22, 30)).norm(), 1e-12);
}

TEST_F(SceneTest, MergesTrianglesIntoRectanglesWhateverTheirNumber) {
  addWall("coarse", "Concrete", {3, -2}, {3, 2}, 0, 3, 1);
  addWall("fine", "Concrete", {4, -2}, {5, 2}, 0, 3, 40);
  const Scene scene = loadScene(writeScene(), kFrequency_hz);
  ASSERT_EQ(scene.facets.size(), 2u);
  for (const Facet& f : scene.facets) {
    EXPECT_TRUE(f.rectangle);
    EXPECT_EQ(f.loops.size(), 1u);
    EXPECT_EQ(f.loops[0].size(), 4u);
    EXPECT_NEAR(f.area_m2, f.size1_m * f.size2_m, 1e-6);
    EXPECT_GE(f.size1_m, f.size2_m);
  }
  EXPECT_NEAR(scene.facets[1].area_m2, 3 * std::hypot(1, 4), 1e-6);
}

TEST_F(SceneTest, BuildsPolygonsWithHoles) {
  // A frame of four rectangles that share edges only in part: outer 4 x 3, hole 2 x 1.
  write("frame.obj",
        "o frame\nusemtl Concrete\nv 5 0 0\nv 5 4 0\nv 5 4 3\nv 5 0 3\nv 5 1 1\nv 5 3 1\nv 5 3 2\nv 5 1 2\n"
        "f 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n");
  write("frame.yaml", "meshes: [{file: frame.obj}]\nmaterials: materials.yaml\n");
  const Scene scene = loadScene(path("frame.yaml"), kFrequency_hz);
  ASSERT_EQ(scene.facets.size(), 1u);
  const Facet& f = scene.facets[0];
  EXPECT_FALSE(f.rectangle);
  EXPECT_EQ(f.loops.size(), 2u);
  EXPECT_NEAR(f.area_m2, 10, 1e-9);
  EXPECT_TRUE(f.contains(V(5, 0.5, 0.5)));
  EXPECT_FALSE(f.contains(V(5, 2, 1.5)));
  EXPECT_FALSE(f.contains(V(5, 4.1, 1.5)));
  EXPECT_LT((f.nearest(V(5, 1.2, 1.5), 0.01) - V(5, 0.99, 1.5)).norm(), 1e-9);
}

TEST_F(SceneTest, NamesPlyAndStlByTheirFiles) {
  write(
      "panel.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n2 0 0\n2 1 0\n2 0 1\n3 0 1 2\n");
  write("plate.stl",
        "solid x\nfacet normal 1 0 0\nouter loop\nvertex 3 0 0\nvertex 3 1 0\nvertex 3 0 "
        "1\nendloop\nendfacet\nendsolid x\n");
  write("s.yaml",
        "meshes: [{file: panel.ply}, {file: plate.stl}]\nmaterials: materials.yaml\n"
        "actors: {panel: {material: Metal}, plate: {material: Concrete}}\n");
  const Scene scene = loadScene(path("s.yaml"), kFrequency_hz);
  ASSERT_EQ(scene.actors.size(), 2u);
  EXPECT_EQ(scene.actors[0].name, "panel");
  EXPECT_EQ(scene.actors[1].name, "plate");
  EXPECT_EQ(scene.actors[1].material_tag, "Concrete");
}

// Data may begin like a line's end.
TEST_F(SceneTest, ReadsBinaryPlyWhateverItsFirstByte) {
  for (const unsigned first : {0x0au, 0x0du, 0x20u}) {
    const std::uint32_t bits = 0x40000000u + first;
    float x = 0;
    std::memcpy(&x, &bits, sizeof x);
    std::string data =
        "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    for (const float v : {x, 0.0f, 0.0f, x, 1.0f, 0.0f, x, 1.0f, 1.0f, x, 0.0f, 1.0f}) {
      data.append(reinterpret_cast<const char*>(&v), sizeof v);
    }
    data += '\4';
    for (const std::int32_t v : {0, 1, 2, 3}) data.append(reinterpret_cast<const char*>(&v), sizeof v);
    write("panel.ply", data);
    write("s.yaml", "meshes: [{file: panel.ply}]\nmaterials: materials.yaml\nactors: {panel: {material: Metal}}\n");
    const Scene scene = loadScene(path("s.yaml"), kFrequency_hz);
    ASSERT_EQ(scene.facets.size(), 1u);
    EXPECT_EQ(scene.facets[0].area_m2, 1);
    EXPECT_EQ(scene.facets[0].origin.x(), static_cast<double>(x));
  }
}

TEST_F(SceneTest, TurnsGltfUpright) {
  // One triangle (0,0,0) (1,0,0) (0,1,0), y up: the third vertex is above the first.
  write(
      "chair.gltf",
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"name":"chair","mesh":0}],)"
      R"("materials":[{"name":"Metal"}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)"
      R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})");
  write("s.yaml", "meshes: [{file: chair.gltf}]\nmaterials: materials.yaml\n");
  const Scene scene = loadScene(path("s.yaml"), kFrequency_hz);
  ASSERT_EQ(scene.actors.size(), 1u);
  EXPECT_EQ(scene.actors[0].name, "chair");
  EXPECT_NEAR(scene.actors[0].bounds.max().z(), 1, 1e-6);
  EXPECT_NEAR(scene.actors[0].bounds.max().y(), 0, 1e-6);
}

TEST_F(SceneTest, NumbersNodesNamedAlike) {
  // Three nodes share one triangle, each moved along x by 1 m more; a fourth bears the second one's number already.
  write(
      "chairs.gltf",
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1,2,3]}],"nodes":[{"name":"chair","mesh":0},)"
      R"({"name":"chair","mesh":0,"translation":[1,0,0]},{"name":"chair_2","mesh":0,"translation":[2,0,0]},)"
      R"({"name":"chair","mesh":0,"translation":[3,0,0]}],)"
      R"("materials":[{"name":"Metal"}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)"
      R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})");
  write("s.yaml",
        "meshes: [{file: chairs.gltf}]\nmaterials: materials.yaml\nactors: {chair_4: {material: Concrete}}\n");
  const Scene scene = loadScene(path("s.yaml"), kFrequency_hz);
  ASSERT_EQ(scene.actors.size(), 4u);
  const std::map<std::string, double> left_m = {{"chair", 0}, {"chair_3", 1}, {"chair_2", 2}, {"chair_4", 3}};
  for (const auto& [name, x_m] : left_m) {
    const int index = scene.actorIndex(name);
    ASSERT_GE(index, 0) << name << " of " << scene.knownActors();
    EXPECT_NEAR(scene.actors[static_cast<std::size_t>(index)].bounds.min().x(), x_m, 1e-6) << name;
  }
  EXPECT_EQ(scene.actors[static_cast<std::size_t>(scene.actorIndex("chair_4"))].material_tag, "Concrete");
  const std::vector<std::string> notes = meshNotes(scene);
  ASSERT_FALSE(notes.empty());
  EXPECT_NE(notes[0].find("chair is chair_3, chair is chair_4"), std::string::npos) << notes[0];
}

TEST_F(SceneTest, ReadsObjNumbersWithoutAZeroBeforeThePoint) {
  write("sheet.mtl", "newmtl Metal\nKd .5 .5 .5\n");
  write("sheet.obj",
        "# v .5 is no vertex here\nmtllib sheet.mtl\no v.05\nvn -1. 0 .0\nvt .5 .5\n"
        "v 0 .05 -0.05\nv\t0 +.5 -.05\nv 0 5.e-1 .25\nv 0 .5e-1 2.5E-1\nusemtl Metal\nf 1/1/1 2/1/1 3/1/1 4/1/1\n");
  write("s.yaml", "meshes: [{file: sheet.obj}]\nmaterials: materials.yaml\n");
  const Scene scene = loadScene(path("s.yaml"), kFrequency_hz);
  ASSERT_EQ(scene.actors.size(), 1u);
  EXPECT_EQ(scene.actors[0].name, "v.05") << "other lines stay as they are";
  EXPECT_EQ(scene.actors[0].material_tag, "Metal");
  ASSERT_EQ(scene.facets.size(), 1u);
  EXPECT_NEAR(scene.facets[0].area_m2, 0.45 * 0.3, 1e-12);
  EXPECT_EQ(scene.actors[0].bounds.min(), V(0, 0.05, -0.05));
  EXPECT_EQ(scene.actors[0].bounds.max(), V(0, 0.5, 0.25));
}

TEST_F(SceneTest, SaysWhatIsWrong) {
  addWall("wall", "Granite", {3, -2}, {3, 2});
  std::string file = writeScene("tag");
  EXPECT_NE(sceneError(file).find("Granite"), std::string::npos);
  EXPECT_NE(sceneError(file).find("wall"), std::string::npos);

  addWall("wall", "Concrete", {3, -2}, {3, 2});
  file = writeScene("key", "", "color: red\n");
  EXPECT_NE(sceneError(file).find("color"), std::string::npos);

  addWall("wall", "Concrete", {3, -2}, {3, 2});
  file = writeScene("override", "", "actors: {door: {material: Metal}}\n");
  EXPECT_NE(sceneError(file).find("door"), std::string::npos);
  EXPECT_NE(sceneError(file).find("wall"), std::string::npos) << "lists the actors there are";

  write("none.yaml", "meshes: [{file: nothing.obj}]\nmaterials: materials.yaml\n");
  EXPECT_NE(sceneError(path("none.yaml")).find("nothing.obj"), std::string::npos);
  write("nomat.yaml", "meshes: [{file: key.obj}]\n");
  EXPECT_NE(sceneError(path("nomat.yaml")).find("materials"), std::string::npos);
  EXPECT_NE(sceneError(path("absent.yaml")).find("absent.yaml"), std::string::npos);

  write("twice.yaml", "meshes: [{file: key.obj}, {file: override.obj}]\nmaterials: materials.yaml\n");
  EXPECT_NE(sceneError(path("twice.yaml")).find("two actors"), std::string::npos);
}

TEST_F(SceneTest, RefusesMeshesThatAreNone) {
  const auto meshError = [this](const std::string& obj) {
    write("bad.obj", obj);
    write("bad.yaml", "meshes: [{file: bad.obj}]\nmaterials: materials.yaml\n");
    return sceneError(path("bad.yaml"));
  };
  EXPECT_NE(meshError("o a\nusemtl Metal\nv 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").find("finite"), std::string::npos);
  EXPECT_NE(meshError("o a\nusemtl Metal\nv 0 0 1e30\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").find("finite"), std::string::npos);
  EXPECT_NE(meshError("o a\nusemtl Metal\nv 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").find("area"), std::string::npos);
  EXPECT_NE(meshError("").find("bad.obj"), std::string::npos);
  EXPECT_NE(meshError("o a\nusemtl Metal\nv 0 0 0\nf 1 2 3\n"), "");
  // A degenerate triangle among good ones does no harm.
  EXPECT_EQ(meshError("o a\nusemtl Metal\nv 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"), "");
}

TEST_F(SceneTest, RefusesFacesOfManyCorners) {
  const auto face = [this](int corners) {
    std::string obj = "o a\nusemtl Metal\n";
    for (int i = 0; i < corners; ++i) {
      obj += "v " + std::to_string(std::cos(2 * M_PI * i / corners)) + " " +
             std::to_string(std::sin(2 * M_PI * i / corners)) + " 0\n";
    }
    obj += "f";
    for (int i = 1; i <= corners; ++i) obj += " " + std::to_string(i);
    write("face.obj", obj + "\n");
    write("face.yaml", "meshes: [{file: face.obj}]\nmaterials: materials.yaml\n");
    return sceneError(path("face.yaml"));
  };
  EXPECT_EQ(face(1000), "");
  EXPECT_NE(face(900000).find("face.obj: a face has 900000 corners; allowed: 4096"), std::string::npos);
}

TEST_F(SceneTest, RefusesAGlbThatClaimsMoreThanItHas) {
  const auto word = [](std::uint32_t value) { return std::string(reinterpret_cast<const char*>(&value), 4); };
  const auto error = [&](std::uint32_t length, std::uint32_t chunk) {
    write("room.glb", "glTF" + word(2) + word(length) + word(chunk) + "JSON{}  ");
    write("glb.yaml", "meshes: [{file: room.glb}]\nmaterials: materials.yaml\n");
    return sceneError(path("glb.yaml"));
  };
  EXPECT_NE(error(4294967295u, 4294967275u).find("room.glb: says to have 4294967295 bytes, and the file has 24"),
            std::string::npos);
  EXPECT_NE(error(24, 4294967275u).find("room.glb: says of a part to have 4294967275 bytes"), std::string::npos);
}

TEST_F(SceneTest, SurvivesDamagedFiles) {
  addBox("cabinet", "Metal", V(1, 1, 0), V(1.5, 1.5, 1));
  writeScene("whole");
  std::ifstream in(path("whole.obj"));
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  std::mt19937 random(1);
  int loaded = 0;
  for (int i = 0; i < 200; ++i) {
    std::string damaged = text;
    for (int k = 0; k < 5; ++k) damaged[random() % damaged.size()] = "0123456789.-e \nfvo"[random() % 18];
    write("whole.obj", damaged);
    loaded += sceneError(path("whole.yaml")).empty();
  }
  EXPECT_GT(loaded, 0);
}

// Walls are open surfaces and furniture runs into walls: neither is an error, and neither may upset the tracing.
TEST_F(SceneTest, TracesOpenAndSelfIntersectingSurfaces) {
  addPolygons("bowtie", "Metal", {V(4, -1, -1), V(4, 1, 1), V(4, 1, -1), V(4, -1, 1)}, {{0, 1, 2, 3}});
  addPolygons("crossed", "RoughMetal",
              {V(3, -1, -1), V(3, 1, -1), V(3, 1, 1), V(3, -1, 1), V(2, 0, -1), V(4, 0, -1), V(4, 0, 1), V(2, 0, 1)},
              {{0, 1, 2, 3}, {4, 5, 6, 7}});
  addPolygons("open_box", "Concrete", {V(5, 1, 0), V(6, 1, 0), V(6, 2, 0), V(5, 2, 0), V(5, 1, 1), V(6, 1, 1)},
              {{0, 1, 5, 4}, {0, 1, 2, 3}, {0, 3, 4}});
  addPolygons("folded_back", "Concrete", {V(5, -2, 0), V(6, -2, 0), V(6, -2, 1), V(5, -2, 1)},
              {{0, 1, 2, 3}, {3, 2, 1, 0}});
  addBox("whole", "Concrete", V(7, -1, 0), V(7.5, -0.5, 1));
  Twin twin = makeTwin(writeScene(), "  specular: {}\n  corner: {}\n  diffuse: {}\n  edge_diffraction: {level: 1}\n");
  const std::vector<std::string> notes = meshNotes(twin.scene());
  ASSERT_EQ(notes.size(), 3u);
  EXPECT_NE(notes[0].find("open_box (5 open edges)"), std::string::npos) << notes[0];
  EXPECT_NE(notes[1].find("crossed (at 3, "), std::string::npos) << notes[1];
  EXPECT_NE(notes[2].find(": folded_back with itself (1 m2)"), std::string::npos) << notes[2];
  for (const std::string& note : notes) EXPECT_EQ(note.find("whole"), std::string::npos) << note;
  for (double y : {-1.5, 0.0, 0.3}) {
    const Simulation s = twin.simulate(radarPose(0, y, 0.2));
    EXPECT_FALSE(s.records.empty());
    EXPECT_TRUE(s.check.ok());
    for (const PathRecord& r : s.records) EXPECT_TRUE(std::isfinite(r.amplitude) && std::isfinite(r.length_m[0]));
  }
}

TEST_F(SceneTest, ChecksTheMaterialsBand) {
  write("materials.yaml",
        "materials: {Carpet: {model: dielectric, relative_permittivity: 2, valid_hz: [1.0e+9, 40.0e+9]}}\n");
  addWall("rug", "Carpet", {3, -2}, {3, 2});
  const std::string file = writeScene();
  EXPECT_NE(sceneError(file).find("Carpet"), std::string::npos);
  EXPECT_NE(sceneError(file).find("extrapolated"), std::string::npos);
  EXPECT_EQ(errorOf([&] { loadScene(file, 30e9); }), "");
}

TEST_F(SceneTest, SeesWhetherAPointIsInsideAClosedActor) {
  addBox("room", "Concrete", V(0, 0, 0), V(8, 6, 3));
  addBox("cabinet", "Metal", V(1, 1, 0), V(1.5, 1.5, 1));
  addWall("screen", "Metal", {4, 1}, {4, 3}, 0, 2);
  const Scene scene = loadScene(writeScene(), kFrequency_hz);
  const RayCaster rays(scene);
  ASSERT_TRUE(rays.insideActor(V(1.2, 1.3, 0.5)));
  EXPECT_EQ(scene.actors[*rays.insideActor(V(1.2, 1.3, 0.5))].name, "cabinet");
  EXPECT_FALSE(rays.insideActor(V(3, 3, 1))) << "a room is meant to be stood in";
  EXPECT_FALSE(rays.insideActor(V(20, 3, 1)));
  EXPECT_FALSE(rays.visible(V(3, 2, 1), V(5, 2, 1)));
  EXPECT_TRUE(rays.visible(V(3, 2, 1), V(3.9, 2, 1)));
  EXPECT_FALSE(rays.visible(V(3, 2, 1), V(NAN, 2, 1)));
  EXPECT_FALSE(rays.firstHit(V(3, 2, 1), V(0, 0, 0), 10));
  const auto hit = rays.firstHit(V(3, 2, 1), V(1, 0, 0), INFINITY);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance_m, 1, 1e-6);
  EXPECT_EQ(scene.actors[hit->actor].name, "screen");
}

// Of a mesh whose vertices are off by 1.5 mm a wall is one facet; where noise breaks it, a note says what to do.
TEST_F(SceneTest, TakesANoisyWallForOneFacet) {
  const auto addNoisyWall = [&](const std::string& name, double grid_m, double noise_m) {
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0, noise_m);
    const int columns = static_cast<int>(std::lround(4 / grid_m)), rows = static_cast<int>(std::lround(2.5 / grid_m));
    std::vector<Eigen::Vector3d> vertices;
    std::vector<std::vector<int>> triangles;
    for (int j = 0; j <= rows; ++j) {
      for (int i = 0; i <= columns; ++i) vertices.push_back(V(3 + noise(random), -2 + i * grid_m, j * grid_m));
    }
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        const int a = j * (columns + 1) + i, c = a + columns + 2;
        triangles.push_back({a, a + 1, c});
        triangles.push_back({a, c, c - 1});
      }
    }
    addPolygons(name, "Concrete", vertices, triangles);
  };
  addNoisyWall("surveyed", 0.5, 0.0015);
  addNoisyWall("scanned", 0.1, 0.004);
  Twin twin = makeTwin(writeScene(), "  specular: {}\n");
  const Scene& scene = twin.scene();
  const Actor& surveyed = scene.actors[static_cast<std::size_t>(scene.actorIndex("surveyed"))];
  ASSERT_EQ(surveyed.facets.size(), 1u);
  EXPECT_GT(std::abs(scene.facets[static_cast<std::size_t>(surveyed.facets[0])].normal.x()), std::cos(0.002));
  bool told = false;
  for (const std::string& note : meshNotes(scene)) {
    EXPECT_EQ(note.find("surveyed"), std::string::npos) << note;
    told |= note.find("facets: {angle_deg: ") != std::string::npos && note.find("scanned (") != std::string::npos;
  }
  EXPECT_TRUE(told);
}

TEST_F(SceneTest, LoadsARealScan) {
  const char* data = std::getenv("MMRADARTWIN_DATA");
  const std::string scan = std::string(data ? data : MMRADARTWIN_DEFAULT_DATA) + "/rooms/hololens_room.ply";
  if (!std::filesystem::exists(scan)) GTEST_SKIP() << "rooms/hololens_room.ply is not there; set MMRADARTWIN_DATA";
  write("scan.yaml", "meshes: [{file: " + scan +
                         "}]\nmaterials: materials.yaml\nactors: {hololens_room: {material: RoughConcrete}}\n"
                         "facets: {angle_deg: 35, offset_m: 0.05}\n");
  const Scene scene = loadScene(path("scan.yaml"), kFrequency_hz);
  ASSERT_EQ(scene.actors.size(), 1u);
  EXPECT_EQ(scene.actors[0].triangles.size(), 117689u);
  EXPECT_LT(scene.facets.size(), 30000u);
  double area = 0, triangles = 0, largest = 0;
  for (const Facet& f : scene.facets) {
    area += f.area_m2;
    largest = std::max(largest, f.area_m2);
  }
  EXPECT_GT(largest, 5) << "a wall is one facet in spite of the noise";
  for (const auto& t : scene.actors[0].triangles) {
    const auto& v = scene.actors[0].vertices;
    triangles += 0.5 * (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]).norm();
  }
  EXPECT_NEAR(area, triangles, 0.01 * triangles);
  RecordProperty("facets", static_cast<int>(scene.facets.size()));
  Twin twin = makeTwin(path("scan.yaml"));
  ASSERT_FALSE(twin.notes().empty()) << "says that orders are left to launched rays";
  const Simulation s = twin.simulate(radarPose(0, 0, 0));
  EXPECT_TRUE(s.check.ok());
  EXPECT_GT(s.records.size(), 100u);
}

}  // namespace
}  // namespace mmradartwin
