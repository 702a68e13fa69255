// Scenes made of scans that are sampled here from boxes and plates: frame, planes, openings, things, edits, bad input.

#include "mmradartwin_sim/scan_to_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <random>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/scan_refinement.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

constexpr double kDeg = M_PI / 180;

/// Points spread evenly at random over rectangles, each moved along its rectangle's normal by Gaussian noise.
class SampledRoom {
 public:
  explicit SampledRoom(double noise_m, double per_m2 = 3000) : noise_(0, noise_m), per_m2_(per_m2) {}

  /// Rectangle corner + [0, 1] a + [0, 1] b; `missing` says which of its points the scan lacks.
  void add(const Eigen::Vector3d& corner, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
           const std::function<bool(const Eigen::Vector3d&)>& missing = nullptr) {
    const Eigen::Vector3d n = a.cross(b).normalized();
    const auto count = static_cast<int>(a.cross(b).norm() * per_m2_);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d p = corner + unit(random_) * a + unit(random_) * b;
      if (!missing || !missing(p)) points_.push_back(p + noise_(random_) * n);
    }
  }
  /// Sides and top of a box, those that a scanner in the room sees.
  void addBox(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    const Eigen::Vector3d s = high - low, x(s.x(), 0, 0), y(0, s.y(), 0), z(0, 0, s.z());
    add(low, x, z), add(low + y, x, z), add(low, y, z), add(low + x, y, z), add(low + z, x, y);
  }
  /// Floor, ceiling and four walls of a room with a corner in the origin.
  void addShell(const Eigen::Vector3d& size, const std::function<bool(const Eigen::Vector3d&)>& missing = nullptr) {
    const Eigen::Vector3d x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z()), zero = Eigen::Vector3d::Zero();
    add(zero, x, y, missing), add(z, x, y, missing);
    add(zero, x, z, missing), add(y, x, z, missing), add(zero, y, z, missing), add(x, y, z, missing);
  }

  /// As a scanner's file holds it: p_file = (T p + shift) / unit.
  RawScan scan(const Eigen::Matrix3d& T = Eigen::Matrix3d::Identity(),
               const Eigen::Vector3d& shift = Eigen::Vector3d::Zero(), double unit_m = 1) const {
    RawScan raw;
    raw.file = "room.xyz";
    for (const Eigen::Vector3d& p : points_) raw.points.push_back(((T * p + shift) / unit_m).cast<float>());
    return raw;
  }
  const std::vector<Eigen::Vector3d>& points() const { return points_; }

 private:
  std::mt19937 random_{7};
  std::normal_distribution<double> noise_;
  double per_m2_;
  std::vector<Eigen::Vector3d> points_;
};

const Eigen::Vector3d kRoom(5, 4, 2.6);

const ScanPlane* planeAt(const ScanScene& scene, const Eigen::Vector3d& normal, double offset_m) {
  for (const ScanPlane& p : scene.planes) {
    if (p.normal.dot(normal) > std::cos(1 * kDeg) && std::abs(p.offset_m - offset_m) < 0.05) return &p;
  }
  return nullptr;
}

const ScanThing* thingOf(const ScanScene& scene, const std::string& klass) {
  for (const ScanThing& t : scene.things) {
    if (t.klass == klass) return &t;
  }
  return nullptr;
}

bool rangeIsOf(const std::vector<MeasuredRange>& ranges, const std::string& actor) {
  return std::any_of(ranges.begin(), ranges.end(), [&actor](const MeasuredRange& r) { return r.actor == actor; });
}

double areaOf(const ScanActor& actor) {
  double area = 0;
  for (const auto& t : actor.triangles) {
    const Eigen::Vector3d a = actor.vertices[static_cast<std::size_t>(t[0])],
                          b = actor.vertices[static_cast<std::size_t>(t[1])],
                          c = actor.vertices[static_cast<std::size_t>(t[2])];
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  return area;
}

class ScanToSceneTest : public SceneFiles {};

TEST_F(ScanToSceneTest, RoomWithNoiseBecomesSixExactPlanes) {
  SampledRoom room(0.005);
  room.addShell(kRoom);
  const ScanScene scene = sceneOfScan(room.scan(), {});
  ASSERT_EQ(scene.planes.size(), 6U);
  EXPECT_TRUE(scene.things.empty());
  const std::vector<std::pair<Eigen::Vector3d, double>> truth = {
      {{0, 0, 1}, 0}, {{0, 0, -1}, -2.6}, {{1, 0, 0}, 0}, {{-1, 0, 0}, -5}, {{0, 1, 0}, 0}, {{0, -1, 0}, -4}};
  for (const auto& [normal, offset_m] : truth) {
    const ScanPlane* plane = planeAt(scene, normal, offset_m);
    ASSERT_NE(plane, nullptr) << normal.transpose();
    EXPECT_NEAR(plane->offset_m, offset_m, 0.001);
    EXPECT_GT(plane->normal.dot(normal), std::cos(0.05 * kDeg));
    EXPECT_NEAR(plane->rms_m, 0.0045, 0.0015);  // voxels average some of it away
  }
  EXPECT_GT(scene.wall_on_planes_m2, 0.97 * scene.wall_m2);
  for (const ScanActor& actor : scene.actors) {
    for (const Eigen::Vector3d& v : actor.vertices) {
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_LT(std::min(std::abs(v[axis]), std::abs(v[axis] - kRoom[axis])), 0.002) << actor.name;
      }
    }
  }
}

TEST_F(ScanToSceneTest, ARadarMovesAWallAndTheRoomStaysClosed) {
  SampledRoom room(0.005);
  room.addShell(kRoom);
  const RawScan scan = room.scan();
  const ScanScene before = sceneOfScan(scan, {});
  const ScanPlane* east = planeAt(before, {-1, 0, 0}, -5);
  ASSERT_NE(east, nullptr);
  const std::vector<MeasuredRange> ranges = {{east->name, 0.020, 0.002, {}, {}}, {"cabinet_1", 0.05, 0.002, {}, {}}};
  ScanOptions options;
  options.shifts = shiftsOf(before, ranges, "measured");
  ASSERT_EQ(options.shifts.size(), 1U);
  const ScanScene after = sceneOfScan(scan, options);
  ASSERT_EQ(after.planes.size(), before.planes.size());
  const ScanPlane* moved = planeAt(after, {-1, 0, 0}, -5.02);
  ASSERT_NE(moved, nullptr);
  EXPECT_EQ(moved->name, east->name);
  EXPECT_NEAR(moved->offset_m, east->offset_m - 0.020, 1e-9);  // outwards, against the normal
  for (const ScanActor& actor : after.actors) {
    for (const Eigen::Vector3d& v : actor.vertices) {
      EXPECT_LT(std::min(std::abs(v.x()), std::abs(v.x() - 5.02)), 0.002) << actor.name;
    }
  }
  EXPECT_EQ(refinementNotes(before, ranges).size(), 1U);
  EXPECT_THROW(shiftsOf(before, {{"cabinet_1", 0.01, 0.001, {}, {}}}, "measured"), InputError);
}

TEST_F(ScanToSceneTest, PartsOfOneWallMoveTogether) {
  SampledRoom room(0.005);
  room.addShell(kRoom, [](const Eigen::Vector3d& p) {  // a passage as high as the room parts the south wall
    return std::abs(p.y()) < 0.001 && p.x() > 2 && p.x() < 3.2 && p.z() > 0 && p.z() < kRoom.z();
  });
  const RawScan scan = room.scan();
  const ScanScene before = sceneOfScan(scan, {});
  std::vector<MeasuredRange> ranges;
  for (const ScanPlane& p : before.planes) {
    if (p.kind != PlaneKind::kWall || p.normal.y() < 0.99) continue;
    const bool first = ranges.empty();
    ranges.push_back({p.name, first ? 0.010 : 0.020, first ? 0.002 : 0.004, {}, {}});
  }
  ASSERT_EQ(ranges.size(), 2U);
  ScanOptions options;
  options.shifts = shiftsOf(before, ranges, "measured");
  ASSERT_EQ(options.shifts.size(), 1U);
  const ScanScene after = sceneOfScan(scan, options);
  ASSERT_EQ(after.planes.size(), before.planes.size());
  for (std::size_t i = 0; i < after.planes.size(); ++i) {  // by (4 * 10 + 20) / 5 mm: weights are 1 / variance
    const bool moves = rangeIsOf(ranges, before.planes[i].name);
    EXPECT_NEAR(after.planes[i].offset_m, before.planes[i].offset_m - (moves ? 0.012 : 0), 1e-9)
        << before.planes[i].name;
  }
}

TEST_F(ScanToSceneTest, ThingsBecomeShapesBoxesOrMeshesAsAsked) {
  SampledRoom room(0.003, 6000);
  room.addShell({6, 5, 2.6});
  const Eigen::AlignedBox3d cabinet(Eigen::Vector3d(0.5, 1, 0.01), Eigen::Vector3d(1.0, 2, 1.9));
  room.addBox(cabinet.min(), cabinet.max());
  room.addBox({4.5, 4.0, 0.35}, {4.95, 4.45, 0.45});  // a chair's seat, and its back
  room.addBox({4.5, 4.45, 0.45}, {4.95, 4.49, 0.9});
  for (int k = 0; k < 60; ++k) {  // a drum
    const double a = k * 6 * kDeg, b = (k + 1) * 6 * kDeg, r = 0.25;
    room.add({3 + r * std::cos(a), 2.5 + r * std::sin(a), 0.01},
             {r * (std::cos(b) - std::cos(a)), r * (std::sin(b) - std::sin(a)), 0}, {0, 0, 0.9});
  }
  const RawScan scan = room.scan();
  const auto sceneWith = [&scan](ThingForms things, std::size_t triangles) {
    ScanOptions options;
    options.things = things, options.triangles = triangles;
    return sceneOfScan(scan, options);
  };
  const auto count = [](const ScanScene& scene) {
    std::size_t sum = 0;
    for (const ScanThing& t : scene.things) sum += t.triangles.size();
    return sum;
  };
  const ScanScene shapes = sceneWith(ThingForms::kShapes, 20000), boxes = sceneWith(ThingForms::kBoxes, 20000),
                  few = sceneWith(ThingForms::kMeshes, 1000), many = sceneWith(ThingForms::kMeshes, 20000);
  ASSERT_EQ(shapes.things.size(), 3U);
  for (const ScanScene* scene : {&boxes, &few, &many}) {
    ASSERT_EQ(scene->things.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(scene->things[i].name, shapes.things[i].name);
  }
  const auto standingAt = [](const ScanScene& scene, const Eigen::Vector3d& p) {
    const auto found = std::find_if(scene.things.begin(), scene.things.end(),
                                    [&p](const ScanThing& t) { return t.bounds.contains(p); });
    return found == scene.things.end() ? nullptr : &*found;
  };
  const Eigen::Vector3d on_seat(4.7, 4.2, 0.44);
  const ScanThing *chair = standingAt(shapes, on_seat), *proxy = standingAt(boxes, on_seat);
  ASSERT_TRUE(chair && proxy);
  EXPECT_GT(chair->triangles.size(), 12U);
  EXPECT_EQ(proxy->shape, ThingShape::kBox);
  EXPECT_EQ(proxy->triangles.size(), 12U);
  EXPECT_TRUE(proxy->watertight);
  EXPECT_NEAR(proxy->bounds.max().z(), 0.9, 0.02);
  EXPECT_NEAR(proxy->bounds.sizes().x(), 0.45, 0.03);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(few.things[i].shape, ThingShape::kMesh);
    EXPECT_EQ(many.things[i].shape, ThingShape::kMesh);
  }
  EXPECT_LT(count(boxes), count(shapes));
  EXPECT_LE(count(few), 1000U);
  EXPECT_GT(count(many), 2 * count(few));
  EXPECT_LE(count(many), 20000U);
  const ScanThing *drum = standingAt(boxes, {3, 2.5, 0.5}), *mesh = standingAt(many, {0.7, 1.5, 1});
  ASSERT_TRUE(drum && mesh);
  EXPECT_EQ(drum->shape, ThingShape::kCylinder);
  for (const Eigen::Vector3d& v : mesh->vertices) {
    const double outside_m = cabinet.exteriorDistance(v);
    const double inside_m = std::min((v - cabinet.min()).minCoeff(), (cabinet.max() - v).minCoeff());
    EXPECT_LT(std::max(outside_m, inside_m), 0.015);
  }
}

TEST_F(ScanToSceneTest, ARadarMovesAThing) {
  SampledRoom room(0.004);
  room.addShell(kRoom);
  room.addBox({2.0, 1.5, 0}, {2.6, 2.0, 1.6});
  room.addBox({4.2, 3.0, 0}, {4.98, 3.9, 1.9});
  ScanScene scene = sceneOfScan(room.scan(), {});
  ASSERT_EQ(scene.things.size(), 2U);
  const std::size_t free = scene.things[0].bounds.max().x() < 3 ? 0 : 1, at_wall = 1 - free;
  const std::vector<ScanThing> before = scene.things;
  write("refinement.yaml",
        "format: mmradartwin_refinement/1\nactors:\n"
        "  " +
            before[free].name +
            ": {range_m: 0.01, std_m: 0.002, shift_m: [0.012, -0.02], shift_covariance_m2: "
            "[4.0e-6, 0, 9.0e-6]}\n"
            "  " +
            before[at_wall].name +
            ": {range_m: 0.01, std_m: 0.002, shift_m: [0.09, 0], shift_covariance_m2: "
            "[4.0e-6, 0, 9.0e-6]}\n");
  const std::vector<MeasuredRange> ranges = readRefinement(folder_);
  EXPECT_TRUE(shiftsOf(scene, ranges, "refinement.yaml").empty());
  const std::vector<std::string> notes = moveThings(ranges, scene);
  EXPECT_EQ(notes.size(), 2U);
  const Eigen::Vector3d by(0.012, -0.02, 0);
  const ScanActor& actor = scene.actors[scene.planes.size() + free];
  EXPECT_EQ(actor.name, before[free].name);
  for (std::size_t k = 0; k < actor.vertices.size(); ++k) {
    EXPECT_LT((actor.vertices[k] - before[free].vertices[k] - by).norm(), 1e-9);
  }
  EXPECT_LT((scene.things[free].bounds.center() - before[free].bounds.center() - by).norm(), 1e-9);
  EXPECT_EQ(scene.things[at_wall].vertices, before[at_wall].vertices);  // it would stand in the wall
}

TEST_F(ScanToSceneTest, RefinementIsReadStrictly) {
  write("refinement.yaml",
        "format: mmradartwin_refinement/1\nrecording: session\nactors:\n"
        "  wall_1: {range_m: -0.004, std_m: 0.001}\n");
  const std::vector<MeasuredRange> ranges = readRefinement(folder_);
  ASSERT_EQ(ranges.size(), 1U);
  EXPECT_EQ(ranges.front().actor, "wall_1");
  EXPECT_DOUBLE_EQ(ranges.front().range_m, -0.004);
  for (const char* actor : {"{range_m: 3, std_m: 0.001}", "{range_m: 0.01}", "{range_m: 0.01, std_m: 0.001, x: 1}"}) {
    write("bad.yaml", std::string("format: mmradartwin_refinement/1\nactors:\n  wall_1: ") + actor + "\n");
    EXPECT_THROW(readRefinement(folder_ + "/bad.yaml"), InputError) << actor;
  }
}

TEST_F(ScanToSceneTest, UnitUpAndFloorAreFound) {
  SampledRoom room(0.003);
  room.addShell(kRoom);
  room.addBox({0.5, 0.05, 0.01}, {1.5, 0.5, 1.8});
  room.addBox({3, 2, 0.01}, {3.6, 2.5, 0.6});
  const Eigen::Matrix3d y_up = Eigen::AngleAxisd(-90 * kDeg, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 0, 2).normalized();
  const Eigen::Matrix3d tilted = Eigen::AngleAxisd(5 * kDeg, axis).toRotationMatrix() * y_up;
  const ScanScene scene = sceneOfScan(room.scan(tilted, tilted * Eigen::Vector3d(0, 0, -1.03), 0.001), {});
  EXPECT_EQ(scene.frame.unit_name, "mm");
  EXPECT_EQ(scene.frame.up_name, "y");
  EXPECT_LT(std::acos(scene.frame.up.dot(tilted * Eigen::Vector3d::UnitZ())), 0.1 * kDeg);
  EXPECT_NEAR(scene.frame.floor_m, -1.03, 0.003);
  EXPECT_NEAR(scene.frame.ceiling_m, 2.6, 0.003);
  // The frame takes points of the file to the floor.
  const Eigen::Vector3d corner = scene.frame.T_map_file * (tilted * Eigen::Vector3d(2, 2, -1.03));
  EXPECT_NEAR(corner.z(), 0, 0.003);
}

TEST_F(ScanToSceneTest, UnitAndUpThatAreStatedWin) {
  SampledRoom room(0.003);
  room.addShell(kRoom);
  ScanOptions options;
  options.unit_m = 2;
  options.up = -Eigen::Vector3d::UnitZ();
  options.floor_m = -5.2;
  const ScanScene scene = sceneOfScan(room.scan(), options);
  EXPECT_EQ(scene.frame.up_name, "-z");
  EXPECT_NEAR(scene.frame.ceiling_m, 5.2, 0.01);
}

TEST_F(ScanToSceneTest, DoorwayAndWindowAreOpenings) {
  SampledRoom room(0.004);
  room.addShell(kRoom, [](const Eigen::Vector3d& p) {
    const bool doorway = std::abs(p.x()) < 0.001 && p.y() > 1 && p.y() < 1.9 && p.z() < 2.05 && p.z() > 0;
    const bool window = std::abs(p.y()) < 0.001 && p.x() > 2 && p.x() < 3.5 && p.z() > 0.9 && p.z() < 2.1;
    return doorway || window;
  });
  const ScanScene scene = sceneOfScan(room.scan(), {});
  const ScanPlane* west = planeAt(scene, {1, 0, 0}, 0);
  const ScanPlane* south = planeAt(scene, {0, 1, 0}, 0);
  ASSERT_TRUE(west && south);
  EXPECT_NEAR(west->area_m2, 4 * 2.6 - 0.9 * 2.05, 0.12);
  ASSERT_EQ(south->holes.size(), 1U);
  EXPECT_NEAR(south->area_m2, 5 * 2.6 - 1.5 * 1.2, 0.12);
  // Triangles are the polygons, no more and no less.
  for (std::size_t i = 0; i < scene.planes.size(); ++i)
    EXPECT_NEAR(areaOf(scene.actors[i]), scene.planes[i].area_m2, 1e-6);
}

TEST_F(ScanToSceneTest, WallBehindACabinetIsClosed) {
  SampledRoom room(0.004);
  const Eigen::Vector3d low(1.5, 0.02, 0.01), high(2.5, 0.5, 2.0);
  room.addShell(kRoom, [&](const Eigen::Vector3d& p) {
    return p.y() < 0.001 && p.x() > low.x() && p.x() < high.x() && p.z() < high.z() && p.z() > 0;
  });
  room.addBox(low, high);
  const ScanScene scene = sceneOfScan(room.scan(), {});
  const ScanPlane* south = planeAt(scene, {0, 1, 0}, 0);
  ASSERT_TRUE(south);
  EXPECT_NEAR(south->area_m2, 5 * 2.6, 0.01);
  const ScanThing* cabinet = thingOf(scene, "cabinet");
  ASSERT_TRUE(cabinet);
  EXPECT_EQ(cabinet->shape, ThingShape::kBox);
  EXPECT_TRUE(cabinet->watertight);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(cabinet->bounds.min()[axis], low[axis], 0.02);
    EXPECT_NEAR(cabinet->bounds.max()[axis], high[axis], 0.01);
  }
}

TEST_F(ScanToSceneTest, FurnitureIsToldApart) {
  SampledRoom room(0.003);
  room.addShell({6, 5, 2.6});
  room.addBox({0.05, 1, 0.01}, {0.5, 2, 1.9});       // cabinet
  room.add({2, 2, 0.74}, {1.6, 0, 0}, {0, 0.8, 0});  // a table's top
  for (double x : {2.05, 3.5}) {
    for (double y : {2.05, 2.7}) room.addBox({x, y, 0.01}, {x + 0.05, y + 0.05, 0.71});
  }
  room.addBox({4.5, 4.0, 0.01}, {4.95, 4.45, 0.45});  // a chair's seat, and its back
  room.addBox({4.5, 4.45, 0.45}, {4.95, 4.49, 0.9});
  room.addBox({3.0, 4.94, 0.15}, {4.0, 4.99, 0.75});  // a radiator
  const ScanScene scene = sceneOfScan(room.scan(), {});
  for (const char* klass : {"cabinet", "table", "chair", "radiator"}) EXPECT_TRUE(thingOf(scene, klass)) << klass;
  const ScanThing* table = thingOf(scene, "table");
  ASSERT_TRUE(table);
  EXPECT_NEAR(table->bounds.max().z(), 0.74, 0.005);
  EXPECT_NEAR(table->bounds.sizes().x(), 1.6, 0.02);
}

TEST_F(ScanToSceneTest, ARoofBoundsWallsAndCeiling) {
  // From a low wall of 1 m at y = 0 a roof rises by 45 deg to the ceiling at y = 1.6.
  SampledRoom room(0.004);
  room.addShell(kRoom, [](const Eigen::Vector3d& p) { return p.z() > 1 + p.y(); });
  room.add({0, 0, 1}, {5, 0, 0}, {0, 1.6, 1.6});
  const ScanScene scene = sceneOfScan(room.scan(), {});
  ASSERT_EQ(scene.planes.size(), 7U);
  const double s = std::sqrt(0.5);
  const ScanPlane *roof = planeAt(scene, {0, s, -s}, -s), *low = planeAt(scene, {0, 1, 0}, 0),
                  *gable = planeAt(scene, {-1, 0, 0}, -5), *ceiling = planeAt(scene, {0, 0, -1}, -2.6),
                  *floor = planeAt(scene, {0, 0, 1}, 0);
  ASSERT_TRUE(roof && low && gable && ceiling && floor);
  EXPECT_NEAR(roof->area_m2, 5 * 1.6 / s, 0.05);
  EXPECT_NEAR(roof->covered_m2, roof->area_m2, 0.03 * roof->area_m2);
  EXPECT_NEAR(low->area_m2, 5 * 1, 0.05);
  EXPECT_NEAR(gable->area_m2, 4 * 2.6 - 0.5 * 1.6 * 1.6, 0.05);
  EXPECT_NEAR(ceiling->area_m2, 5 * 2.4, 0.05);
  EXPECT_NEAR(floor->area_m2, 5 * 4, 0.05);
  EXPECT_TRUE(scene.things.empty());
}

TEST_F(ScanToSceneTest, AWallThatCutsACornerEndsTheFloor) {
  SampledRoom room(0.004);
  room.addShell(kRoom, [](const Eigen::Vector3d& p) { return p.x() + p.y() > 7.6; });
  room.add({5, 2.6, 0}, {-1.4, 1.4, 0}, {0, 0, 2.6});
  const ScanScene scene = sceneOfScan(room.scan(), {});
  const ScanPlane *floor = planeAt(scene, {0, 0, 1}, 0), *ceiling = planeAt(scene, {0, 0, -1}, -2.6);
  ASSERT_TRUE(floor && ceiling);
  EXPECT_TRUE(planeAt(scene, {-std::sqrt(0.5), -std::sqrt(0.5), 0}, -7.6 * std::sqrt(0.5)));
  EXPECT_NEAR(floor->area_m2, 20 - 0.5 * 1.4 * 1.4, 0.05);
  EXPECT_NEAR(ceiling->area_m2, 20 - 0.5 * 1.4 * 1.4, 0.05);
}

TEST_F(ScanToSceneTest, SmallThingsOfNoSureClassAreLeftOut) {
  SampledRoom room(0.003);
  room.addShell(kRoom);
  room.addBox({1.5, 1.5, 1.5}, {1.7, 1.7, 1.7});  // 0.2 m2 are seen of it
  room.addBox({3.0, 2.0, 1.4}, {3.6, 2.6, 2.0});  // 1.8 m2
  const ScanScene scene = sceneOfScan(room.scan(), {});
  ASSERT_EQ(scene.things.size(), 1U);
  EXPECT_NEAR(scene.things[0].bounds.min().x(), 3.0, 0.02);
  EXPECT_TRUE(std::any_of(scene.notes.begin(), scene.notes.end(), [](const std::string& note) {
    return note.find("in small things of no sure class") != std::string::npos;
  }));
}

TEST_F(ScanToSceneTest, AnInnerWallIsCutFromWhatLeansOnIt) {
  SampledRoom room(0.004);
  const Eigen::Vector3d size(8, 6, 2.6);
  room.addShell(size);
  room.addBox({2, 3, 0}, {5, 3.12, 2.45});
  // Two heaps that lean on it: their tops are no table's.
  for (int k = 0; k < 4; ++k) {
    const double x = 2.2 + 0.7 * k, z = 0.3 + 0.2 * k;
    room.add({x, 3.12, z}, {0.6, 0, 0.1}, {0, 0.7 + 0.1 * k, -0.25});
    room.add({x, 3.0, z}, {0.6, 0, -0.1}, {0, -0.8 + 0.1 * k, -0.25});
  }
  const ScanScene scene = sceneOfScan(room.scan(), {});
  const ScanThing* wall = thingOf(scene, "partition");
  ASSERT_TRUE(wall);
  EXPECT_NEAR(wall->bounds.min().y(), 3, 0.05);
  EXPECT_NEAR(wall->bounds.max().y(), 3.12, 0.05);
  EXPECT_NEAR(wall->bounds.sizes().x(), 3, 0.06);
}

TEST_F(ScanToSceneTest, CylinderAndItsRadiusAreFound) {
  SampledRoom room(0.002);
  room.addShell({6, 5, 2.6});
  for (int k = 0; k < 60; ++k) {
    const double a = k * 6 * kDeg, b = (k + 1) * 6 * kDeg, r = 0.25;
    room.add({3 + r * std::cos(a), 2.5 + r * std::sin(a), 0.01},
             {r * (std::cos(b) - std::cos(a)), r * (std::sin(b) - std::sin(a)), 0}, {0, 0, 0.9});
  }
  const ScanScene scene = sceneOfScan(room.scan(), {});
  ASSERT_EQ(scene.things.size(), 1U);
  EXPECT_EQ(scene.things[0].shape, ThingShape::kCylinder);
  EXPECT_NEAR(scene.things[0].bounds.sizes().x(), 0.5, 0.01);
}

TEST_F(ScanToSceneTest, UpOfACorridorThatIsHigherThanWideIsFound) {
  SampledRoom room(0.003, 1500);
  room.addShell({9, 2.0, 2.7});
  room.addBox({1, 0.02, 0}, {2.2, 0.5, 1.9});  // all furniture at one wall
  room.addBox({4, 0.02, 0}, {5.0, 0.45, 1.8});
  const ScanScene z_up = sceneOfScan(room.scan(), {});
  EXPECT_EQ(z_up.frame.up_name, "z");
  EXPECT_NEAR(z_up.frame.ceiling_m, 2.7, 0.002);
  Eigen::Matrix3d y_up;
  y_up << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  EXPECT_NEAR(sceneOfScan(room.scan(y_up), {}).frame.ceiling_m, 2.7, 0.002);
}

TEST_F(ScanToSceneTest, DoubledWallIsOnePlane) {
  SampledRoom room(0.003);
  room.addShell(kRoom);
  room.add({0, 0.035, 0}, {2.5, 0, 0}, {0, 0, 2.6});  // half of a wall once more, by drift
  const ScanScene scene = sceneOfScan(room.scan(), {});
  int south = 0;
  for (const ScanPlane& p : scene.planes) south += p.normal.y() > 0.99;
  EXPECT_EQ(south, 1);
  for (const ScanThing& t : scene.things) {
    ADD_FAILURE() << t.name << " " << t.bounds.min().transpose() << " to " << t.bounds.max().transpose();
  }
  // Two thirds of its samples lie at 0 and a third at 35 mm; its residual says so.
  const ScanPlane* wall = planeAt(scene, {0, 1, 0}, 0);
  ASSERT_NE(wall, nullptr);
  EXPECT_NEAR(wall->offset_m, 0.035 / 3, 0.002);
  EXPECT_NEAR(wall->rms_m, 0.035 * std::sqrt(2.0) / 3, 0.002);
}

/// One frame of a depth camera at the origin, z forward and y down, 1.4 m above the floor: depths come in steps of
/// 0.0029 z^2, each pixel with less than a step's error more.
RawScan depthFrame() {
  RawScan raw;
  raw.file = "frame.pcd";
  raw.camera_axes = true, raw.metres = true;
  std::mt19937 random(5);
  std::normal_distribution<double> steps(0, 0.4);
  for (int v = -240; v < 240; v += 2) {
    for (int u = -320; u < 320; u += 2) {
      const Eigen::Vector3d ray((u + 0.5) / 525, (v + 0.5) / 525, 1);
      double z = 4.8;                                   // the back wall
      if (ray.x() > 0) z = std::min(z, 1.3 / ray.x());  // the right wall
      if (ray.y() > 0) z = std::min(z, 1.4 / ray.y());  // the floor
      const double at_table = 0.7 / ray.y(), x = at_table * ray.x();
      if (ray.y() > 0 && at_table > 2.2 && at_table < 3.2 && x < -0.6 && x > -1.3) z = std::min(z, at_table);
      const double step = 0.0029 * z * z;
      raw.points.push_back((step * std::round(z / step + steps(random)) * ray).cast<float>());
    }
  }
  return raw;
}

TEST_F(ScanToSceneTest, LimitsOfADepthCamerasFrameFollowItsNoise) {
  const auto backs = [](const ScanScene& scene) {  // the camera's forward is x
    return std::count_if(scene.planes.begin(), scene.planes.end(),
                         [](const ScanPlane& p) { return p.normal.x() < -0.99; });
  };
  RawScan frame = depthFrame();
  const ScanScene scene = sceneOfScan(frame, {});
  EXPECT_NEAR(scene.frame.floor_m, -1.4, 0.05);  // and not the table, 0.7 m higher
  EXPECT_LT(scene.frame.tilt_deg, 1.5);
  EXPECT_EQ(backs(scene), 1);
  const ScanPlane* wall = planeAt(scene, {-1, 0, 0}, -4.8);
  ASSERT_NE(wall, nullptr);
  EXPECT_NEAR(wall->offset_m, -4.8, 0.02);
  // With one number for all ranges much of the wall is left out: it falls to sheets of one depth step each.
  frame.camera_axes = false;
  ScanOptions options;
  options.up = -Eigen::Vector3d::UnitY();
  const ScanScene by_one_number = sceneOfScan(frame, options);
  const ScanPlane* sheet = planeAt(by_one_number, {-1, 0, 0}, -4.8);
  EXPECT_GT(wall->samples, 1.2 * static_cast<double>(sheet ? sheet->samples : 0)) << (sheet ? sheet->offset_m : 0);
}

TEST_F(ScanToSceneTest, WrittenSceneLoadsAndGivesTheSameBytesAgain) {
  SampledRoom room(0.004);
  room.addShell(kRoom);
  room.addBox({1.5, 1.5, 0.01}, {2.5, 2.0, 1.5});
  for (const char* name : {"a", "b"}) {
    std::filesystem::create_directory(path(name));
    writeScanScene(sceneOfScan(room.scan(), {}), path(name));
  }
  const auto read = [](const std::string& file) {
    std::ifstream in(file);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  };
  for (const char* file : {"/room.obj", "/scene.yaml", "/materials.yaml", "/scan.yaml"}) {
    EXPECT_FALSE(read(path("a") + file).empty());
    EXPECT_EQ(read(path("a") + file), read(path("b") + file)) << file;
  }
  const Scene scene = loadScene(path("a") + "/scene.yaml", 77e9);
  EXPECT_EQ(scene.actors.size(), 7U);
  EXPECT_EQ(scene.bodies.size(), 1U);
  EXPECT_GE(scene.actorIndex("floor"), 0);
  EXPECT_EQ(scene.facets.size(), 6U + 6U);
}

TEST_F(ScanToSceneTest, PersonsMaterialsStay) {
  SampledRoom room(0.004);
  room.addShell(kRoom);
  const ScanScene scene = sceneOfScan(room.scan(), {});
  std::filesystem::create_directory(path("first"));
  std::filesystem::create_directory(path("second"));
  writeScanScene(scene, path("first"));
  std::ifstream in(path("first") + "/scene.yaml");
  std::stringstream text;
  text << in.rdbuf();
  std::string edited = text.str();
  const std::size_t at = edited.find("wall_2: {material: Concrete}");
  ASSERT_NE(at, std::string::npos);
  edited.replace(at, 28, "wall_2: {material: Brick}");
  std::ofstream(path("first") + "/scene.yaml") << edited;
  std::ofstream(path("first") + "/materials.yaml")
      << "materials:\n  Brick: {model: dielectric, relative_permittivity: 3.91}\n"
         "  Concrete: {model: dielectric, relative_permittivity: 6.1}\n";
  writeScanScene(scene, path("second"), path("first") + "/scene.yaml");
  const Scene loaded = loadScene(path("second") + "/scene.yaml", 77e9);
  const auto material = [&](const char* name) {
    return loaded.actors[static_cast<std::size_t>(loaded.actorIndex(name))].material;
  };
  EXPECT_EQ(material("wall_2").name, "Brick");
  EXPECT_EQ(material("wall_1").name, "Concrete");
  EXPECT_DOUBLE_EQ(material("wall_1").relative_permittivity, 6.1);
}

TEST_F(ScanToSceneTest, LevelsAreKnownAsWellAsMaterials) {
  SampledRoom room(0.004);
  room.addShell(kRoom);
  const ScanScene scene = sceneOfScan(room.scan(), {});
  // |Gamma| at normal incidence by ITU-R P.2040 at 77 GHz, times sqrt(1 - S^2).
  const auto level_db = [](double gamma, double s) { return 20 * std::log10(gamma * std::sqrt(1 - s * s)); };
  const double concrete = level_db(0.3926, 0.5);
  double squares = 0;
  for (double other : {level_db(0.246, 0.2), level_db(0.1714, 0), level_db(0.431, 0)})
    squares += std::pow(other - concrete, 2) / 3;
  // Four walls are sure by 0.4, floor and ceiling by 0.5; 1.5 dB is what a known material leaves.
  const double expected = std::sqrt(1.5 * 1.5 + squares * (4 * 0.6 + 2 * 0.5) / 6);
  EXPECT_NEAR(scene.accuracy.level_db, expected, 0.1);
  // A person looks at two walls: changes one, and takes the comment of the other away.
  std::filesystem::create_directory(path("seen"));
  writeScanScene(scene, path("seen"));
  std::ifstream in(path("seen") + "/scene.yaml");
  std::stringstream text;
  text << in.rdbuf();
  std::string edited = text.str();
  edited.replace(edited.find("wall_1: {material: Concrete}"), 28, "wall_1: {material: Wood}");
  const std::size_t comment = edited.find("# proposed", edited.find("wall_2: {"));
  edited.erase(comment, edited.find('\n', comment) - comment);
  std::ofstream(path("seen") + "/scene.yaml") << edited;
  const double seen = std::sqrt(1.5 * 1.5 + squares * (2 * 0.6 + 2 * 0.5) / 6);
  for (int again = 0; again < 3; ++again) {  // into the same folder, as often as a person likes
    EXPECT_NEAR(writeScanScene(scene, path("seen"), path("seen") + "/scene.yaml").level_db, seen, 0.1);
  }
}

TEST_F(ScanToSceneTest, FacesLieAsFarOffAsIsStated) {
  double squares = 0, stated = 0, count = 0, before_m = 0;
  for (const double noise_m : {0.003, 0.006}) {
    SampledRoom room(noise_m, 2000);
    room.addShell(kRoom);
    const std::vector<Eigen::AlignedBox3d> truth = {{Eigen::Vector3d(0.7, 0.5, 0), Eigen::Vector3d(1.5, 1.0, 1.8)},
                                                    {Eigen::Vector3d(3.2, 2.5, 0), Eigen::Vector3d(3.6, 2.9, 0.5)},
                                                    {Eigen::Vector3d(3.9, 0.6, 0), Eigen::Vector3d(4.2, 1.2, 1.2)}};
    for (const Eigen::AlignedBox3d& box : truth) room.addBox(box.min(), box.max());
    const ScanScene scene = sceneOfScan(room.scan(), {});
    ASSERT_EQ(scene.things.size(), 3U);
    for (const ScanThing& t : scene.things) {
      const auto nearest = std::min_element(truth.begin(), truth.end(), [&](const auto& a, const auto& b) {
        return (a.center() - t.bounds.center()).norm() < (b.center() - t.bounds.center()).norm();
      });
      for (int axis = 0; axis < 2; ++axis) {
        squares += std::pow(t.bounds.min()[axis] - nearest->min()[axis], 2);
        squares += std::pow(t.bounds.max()[axis] - nearest->max()[axis], 2);
        stated += 2 * t.range_std_m * t.range_std_m, count += 2;
      }
    }
    EXPECT_GT(scene.accuracy.scene_m, 1.3 * before_m);
    EXPECT_LT(scene.accuracy.scene_m, 3 * noise_m);
    before_m = scene.accuracy.scene_m;
  }
  // White noise averages out better than a scanner's errors do: what is stated is no less.
  EXPECT_LT(std::sqrt(squares / count), std::sqrt(stated / count));
}

TEST_F(ScanToSceneTest, WhatIsNoRoomIsSaidInOneLine) {
  const auto said = [](const SampledRoom& room) { return errorOf([&] { sceneOfScan(room.scan(), {}); }); };
  SampledRoom plane(0.003);
  plane.add({0, 0, 0}, {4, 0, 0}, {0, 4, 0});
  EXPECT_NE(said(plane).find("nothing upright"), std::string::npos) << said(plane);
  SampledRoom wide(0.003, 1);
  wide.add({0, 0, 0}, {900, 0, 0}, {0, 900, 0});
  EXPECT_NE(said(wide).find("no room"), std::string::npos) << said(wide);
}

TEST_F(ScanToSceneTest, FilesThatAreNoScansAreRefused) {
  write("empty.ply", "");
  write("two.xyz", "0 0 0\n1 1 1\n");
  write("huge.ply",
        "ply\nformat binary_little_endian 1.0\nelement vertex 10000000\nproperty float x\nproperty float y\nproperty "
        "float z\n"
        "element face 20000000\nproperty list uchar int vertex_indices\nend_header\n" +
            std::string(20000000, 'x'));
  for (const char* name : {"empty.ply", "two.xyz", "huge.ply", "absent.pcd"}) {
    const std::string error = errorOf([&] { readScan(path(name)); });
    EXPECT_FALSE(error.empty()) << name;
    EXPECT_EQ(error.find('\n'), std::string::npos);
    EXPECT_NE(error.find(name), std::string::npos) << error;
  }
  EXPECT_NE(errorOf([&] { readScan(path("huge.ply")); }).find("more than"), std::string::npos);
}

TEST_F(ScanToSceneTest, FarAndMissingPointsAreReadWithoutLoss) {
  std::ostringstream text;
  text.precision(12);
  SampledRoom room(0.002);
  room.addShell(kRoom);
  const Eigen::Vector3d origin(431200.25, 5412300.5, 312.125);
  for (const Eigen::Vector3d& p : room.points()) text << (p + origin).transpose() << "\n";
  text << "nan nan nan\n";
  write("far.xyz", text.str());
  const RawScan scan = readScan(path("far.xyz"));
  EXPECT_EQ(scan.left_out, 1U);
  const ScanScene scene = sceneOfScan(scan, {});
  EXPECT_NEAR(scene.frame.floor_m, 312.125, 0.001);
  const ScanPlane* east = nullptr;
  for (const ScanPlane& p : scene.planes) {
    if (p.normal.x() < -0.99) east = &p;
  }
  ASSERT_TRUE(east);
  // Back in the file's coordinates.
  const Eigen::Vector3d p = scene.frame.T_map_file.inverse() * east->at({0, 1});
  EXPECT_NEAR(p.x(), 431200.25 + 5, 0.002);
}

}  // namespace
}  // namespace mmradartwin
