// Things that were scanned by themselves and stand in a room's scan: shapes, places, what they replace, bad input.

#include "mmradartwin_sim/scan_objects.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>

#include "mmradartwin_dsp/input_error.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using Eigen::Vector3d;

const Vector3d kSize(0.8, 0.4, 1.2);  // of the thing that has a scan of its own
const Vector3d kPlace(2.5, 2.2, 0);   // of the middle of its foot
constexpr double kYaw_rad = 0.52;

/// Points even over rectangles, with noise along their normals.
class Sampled {
 public:
  Sampled(double noise_m, unsigned seed) : random_(seed), noise_(0, noise_m) {}

  void addRectangle(const Vector3d& corner, const Vector3d& a, const Vector3d& b) {
    const Vector3d n = a.cross(b).normalized();
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < static_cast<int>(2000 * a.cross(b).norm()); ++i) {
      points.push_back(corner + unit(random_) * a + unit(random_) * b + noise_(random_) * n);
    }
  }
  void addShell(const Vector3d& s) {
    const Vector3d x(s.x(), 0, 0), y(0, s.y(), 0), z(0, 0, s.z()), zero = Vector3d::Zero();
    addRectangle(zero, x, y), addRectangle(z, x, y), addRectangle(zero, x, z);
    addRectangle(y, x, z), addRectangle(zero, y, z), addRectangle(x, y, z);
  }
  /// Sides and top of a box whose foot has its middle at the origin, placed by T.
  void addBox(const Vector3d& s, const Eigen::Isometry3d& T) {
    const Vector3d low(-s.x() / 2, -s.y() / 2, 0), x(s.x(), 0, 0), y(0, s.y(), 0), z(0, 0, s.z());
    const auto add = [&](const Vector3d& corner, const Vector3d& a, const Vector3d& b) {
      addRectangle(T * corner, T.linear() * a, T.linear() * b);
    };
    add(low, x, z), add(low + y, x, z), add(low, y, z), add(low + x, y, z), add(low + z, x, y);
  }
  RawScan scan(const std::string& file, double unit_m = 1) const {
    RawScan raw;
    raw.file = file;
    for (const Vector3d& p : points) raw.points.push_back((p / unit_m).cast<float>());
    return raw;
  }

  std::vector<Vector3d> points;

 private:
  std::mt19937 random_;
  std::normal_distribution<double> noise_;
};

Eigen::Isometry3d placed(const Vector3d& at, double yaw_rad) {
  return Eigen::Translation3d(at) * Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ());
}

/// The room with the thing as the room's scan has it: noisier, and 2 cm aside.
Sampled roomWithThing() {
  Sampled room(0.006, 3);
  room.addShell({5, 4, 2.6});
  room.addBox(kSize, placed(kPlace + Vector3d(0.02, -0.01, 0), kYaw_rad));
  return room;
}

ScanObject thing(const std::string& name, double unit_m = 1) {
  Sampled own(0.002, 4);
  own.addBox(kSize, Eigen::Isometry3d::Identity());
  ScanObject object;
  object.name = name;
  object.scan = own.scan(name + ".ply", unit_m);
  object.T_object = placed(kPlace, kYaw_rad);
  return object;
}

const ScanThing* named(const ScanScene& scene, const std::string& name) {
  for (const ScanThing& t : scene.things) {
    if (t.name == name) return &t;
  }
  return nullptr;
}

/// What sceneOfScan() says of objects that it refuses.
std::string refusal(std::vector<ScanObject> objects) {
  ScanOptions options;
  options.objects = std::move(objects);
  try {
    sceneOfScan(roomWithThing().scan("room.xyz"), options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

class ScanObjectsTest : public SceneFiles {};

TEST_F(ScanObjectsTest, AnObjectReplacesWhatTheRoomHasOfIt) {
  const RawScan room = roomWithThing().scan("room.xyz");
  ASSERT_EQ(sceneOfScan(room, {}).things.size(), 1U);
  ScanOptions options;
  options.objects = {thing("fridge_left", 1e-3)};
  options.objects[0].material = "Metal";
  options.objects[0].unit_m = 1e-3;
  const ScanScene scene = sceneOfScan(room, options);
  ASSERT_EQ(scene.things.size(), 1U);
  const ScanThing* found = named(scene, "fridge_left");
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->shape, ThingShape::kBox);
  const Eigen::Isometry3d back = placed(kPlace, kYaw_rad).inverse();
  for (const Vector3d& v : found->vertices) {
    const Vector3d p = back * v;
    EXPECT_NEAR(std::abs(p.x()), kSize.x() / 2, 0.003);
    EXPECT_NEAR(std::abs(p.y()), kSize.y() / 2, 0.003);
    EXPECT_LT(std::min(std::abs(p.z() - 0.01), std::abs(p.z() - kSize.z())), 0.003);
  }
  const auto material = std::find_if(scene.materials.begin(), scene.materials.end(),
                                     [](const MaterialProposal& p) { return p.actor == "fridge_left"; });
  ASSERT_NE(material, scene.materials.end());
  EXPECT_EQ(material->tag, "Metal");
  EXPECT_EQ(material->confidence, 1);
}

TEST_F(ScanObjectsTest, APoseInTheRoomsScanIsThatInMap) {
  // The room's scan has y up and its floor 1.3 m below the origin.
  Eigen::Isometry3d T_file_map = Eigen::Isometry3d::Identity();
  T_file_map.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  T_file_map.translation() = Vector3d(0.4, -1.3, 0.2);
  Sampled room = roomWithThing();
  for (Vector3d& p : room.points) p = T_file_map * p;
  ScanOptions options;
  options.up = Vector3d::UnitY();
  options.objects = {thing("locker")};
  options.objects[0].T_object = T_file_map * options.objects[0].T_object;
  options.objects[0].in_scan = true;
  const ScanScene scene = sceneOfScan(room.scan("room.xyz"), options);
  ASSERT_EQ(scene.things.size(), 1U);
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& v : scene.things[0].vertices) middle += v / static_cast<double>(scene.things[0].vertices.size());
  const Vector3d truth = scene.frame.T_map_file * (T_file_map * kPlace);
  EXPECT_LT((middle - truth).head<2>().norm(), 0.003);
  EXPECT_NEAR(truth.z(), 0, 0.005);
  EXPECT_EQ(scene.things[0].shape, ThingShape::kBox);
}

TEST_F(ScanObjectsTest, UnitsAreFoundAsTheRoomHasThemOrByTheOnlySizeThatFits) {
  ScanOptions options;
  options.objects = {thing("fridge", 1e-3)};  // 1200 units high: 1.2 m in mm, 12 m in cm
  const ScanScene scene = sceneOfScan(roomWithThing().scan("room.xyz"), options);
  ASSERT_NE(named(scene, "fridge"), nullptr);
  EXPECT_NEAR(named(scene, "fridge")->bounds.max().z(), 1.2, 0.004);
  ScanObject small = thing("fridge", 1e-3);  // 0.24 m in mm, 2.4 m in cm
  for (Eigen::Vector3f& p : small.scan.points) p *= 0.2F;
  const std::string said = refusal({small});
  EXPECT_NE(said.find("state its unit"), std::string::npos) << said;
}

TEST_F(ScanObjectsTest, OtherThingsStayAndGetOtherNames) {
  Sampled room = roomWithThing();
  room.addBox({0.5, 0.5, 1.8}, placed({0.8, 3.2, 0}, 0));
  const ScanScene before = sceneOfScan(room.scan("room.xyz"), {});
  ASSERT_EQ(before.things.size(), 2U);
  const std::string other = before.things[0].bounds.max().z() > 1.5 ? before.things[0].name : before.things[1].name;
  ScanOptions options;
  options.objects = {thing(other)};
  const ScanScene scene = sceneOfScan(room.scan("room.xyz"), options);
  ASSERT_EQ(scene.things.size(), 2U);
  EXPECT_EQ(scene.things[0].name, other);
  EXPECT_NEAR(scene.things[0].bounds.max().z(), 1.2, 0.004);
  EXPECT_NE(scene.things[1].name, other);
  EXPECT_NEAR(scene.things[1].bounds.max().z(), 1.8, 0.01);
}

TEST_F(ScanObjectsTest, ObjectsAndThingsTakeTheFormThatIsAsked) {
  // A chair has a scan of its own, in which its seat and its back are no box; a cabinet is a thing of the room's scan.
  const Vector3d seat(0.5, 0.5, 0.45), back(0.5, 0.06, 0.5);
  const auto add_chair = [&](const Eigen::Isometry3d& T, Sampled& to) {
    to.addBox(seat, T);
    to.addBox(back, T * Eigen::Translation3d(0, 0.22, 0.45));
  };
  Sampled own(0.002, 4), room(0.004, 3);
  add_chair(Eigen::Isometry3d::Identity(), own);
  room.addShell({5, 4, 2.6});
  room.addBox({0.5, 0.4, 1.8}, placed({0.8, 3.2, 0}, 0));
  add_chair(placed(kPlace, 0), room);
  ScanObject chair;
  chair.name = "chair_scanned";
  chair.scan = own.scan("chair.ply");
  chair.T_object = placed(kPlace, 0);
  const auto scene_with = [&](ThingForms forms) {
    ScanOptions options;
    options.things = forms, options.objects = {chair};
    return sceneOfScan(room.scan("room.xyz"), options);
  };
  const ScanScene boxes = scene_with(ThingForms::kBoxes), meshes = scene_with(ThingForms::kMeshes);
  for (const ScanScene* scene : {&boxes, &meshes}) {
    ASSERT_EQ(scene->things.size(), 2U);
    EXPECT_EQ(scene->things[0].name, "chair_scanned");
    // Its place and size are those of its own scan, whatever the form.
    const Eigen::AlignedBox3d& b = scene->things[0].bounds;
    EXPECT_LT((b.center() - Vector3d(kPlace.x(), kPlace.y(), 0.475)).cwiseAbs().maxCoeff(), 0.012);
    EXPECT_LT((b.sizes() - Vector3d(0.5, 0.5, 0.95)).cwiseAbs().maxCoeff(), 0.025);
  }
  for (const ScanThing& thing : boxes.things) {
    EXPECT_EQ(thing.shape, ThingShape::kBox) << thing.name;
    EXPECT_EQ(thing.triangles.size(), 12U) << thing.name;
  }
  for (const ScanThing& thing : meshes.things) {
    EXPECT_EQ(thing.shape, ThingShape::kMesh) << thing.name;
    EXPECT_GT(thing.triangles.size(), 12U) << thing.name;
  }
  // Of the mesh, the space over the seat and before the back is free, which its box fills.
  const Vector3d over_seat = kPlace + Vector3d(0, -0.1, 0.6);
  EXPECT_TRUE(boxes.things[0].bounds.contains(over_seat));
  for (const Vector3d& v : meshes.things[0].vertices) EXPECT_GT((v - over_seat).norm(), 0.1);
}

TEST_F(ScanObjectsTest, WhatIsLeftOutIsSaidBesideObjects) {
  Sampled room = roomWithThing();
  room.addBox({0.15, 0.15, 0.15}, placed({0.8, 3.2, 1.0}, 0));  // small, of no class
  const auto says_it = [](const ScanScene& scene) {
    return std::any_of(scene.notes.begin(), scene.notes.end(), [](const std::string& note) {
      return note.find("small things of no sure class") != std::string::npos;
    });
  };
  ScanOptions options;
  ASSERT_TRUE(says_it(sceneOfScan(room.scan("room.xyz"), options)));
  options.objects = {thing("fridge")};
  EXPECT_TRUE(says_it(sceneOfScan(room.scan("room.xyz"), options)));
}

TEST_F(ScanObjectsTest, PlacesThatCannotBeAreSaidInOneLine) {
  ScanObject outside = thing("fridge");
  outside.T_object.translation().x() += 4;
  const std::string is_outside = refusal({outside}), is_twice = refusal({thing("fridge"), thing("locker")});
  EXPECT_NE(is_outside.find("object fridge lies by 100 % outside of the room"), std::string::npos) << is_outside;
  ScanObject in_the_wall = thing("fridge");
  in_the_wall.T_object = placed({0.2, 2, 0}, 0);
  EXPECT_NE(refusal({in_the_wall}).find("outside of the room"), std::string::npos);
  EXPECT_NE(is_twice.find("fill the same place"), std::string::npos);
  EXPECT_NE(refusal({thing("floor")}).find("has the name of a plane"), std::string::npos);
  EXPECT_EQ(is_outside.find('\n') + is_twice.find('\n'), 2 * std::string::npos);
  ScanObject beside = thing("locker");  // another one of its kind, next to it
  beside.T_object = beside.T_object * Eigen::Translation3d(kSize.x(), 0, 0);
  EXPECT_EQ(refusal({thing("fridge"), beside}), "");
}

TEST_F(ScanObjectsTest, ObjectsYamlIsReadStrictly) {
  const auto said = [this](const std::string& text) {
    write("objects.yaml", text);
    try {
      readScanObjects(path("objects.yaml"));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  {
    std::ofstream out(path("box.obj"));
    for (int i = 0; i < 8; ++i) out << "v " << (i & 1) << ' ' << (i >> 1 & 1) << ' ' << (i >> 2) << '\n';
    out << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  }
  EXPECT_EQ(said("objects:\n  fridge: {file: box.obj, pose: [1, 2, 0, 0, 0, 0, 1]}\n"), "");
  EXPECT_NE(said("objects:\n  fridge: {file: none.obj, pose: [1, 2, 0, 0, 0, 0, 1]}\n").find("none.obj"),
            std::string::npos);
  EXPECT_NE(said("objects:\n  fridge: {file: box.obj, pose: [1, 2, 0, 0, 0, 1]}\n").find("has 6 numbers"),
            std::string::npos);
  EXPECT_NE(said("objects:\n  fridge: {file: box.obj, pose: [1, 2, 0, 0, 0, 0, 0]}\n").find("no unit quaternion"),
            std::string::npos);
  EXPECT_NE(said("objects:\n  fridge: {file: box.obj, pose: [1, 2, 0, 0, 0, 0, 1], material: Iron}\n").find("Metal"),
            std::string::npos);
  EXPECT_NE(said("objects:\n  a b: {file: box.obj, pose: [1, 2, 0, 0, 0, 0, 1]}\n").find("is no name of an actor"),
            std::string::npos);
  EXPECT_NE(said("objects: {}\n").find("names no object"), std::string::npos);
}

}  // namespace
}  // namespace mmradartwin
