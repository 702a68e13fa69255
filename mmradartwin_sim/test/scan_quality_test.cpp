// Checks and pictures of a scene made of a scan, on rooms that are put together here.
#include "mmradartwin_sim/scan_quality.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <sstream>

namespace mmradartwin {
namespace {

const Eigen::Vector3d kRoom(5, 4, 2.6);

/// A rectangle from a corner along two edges, with samples 4 cm apart; its normal is edge1 x edge2.
ScanPlane plane(const std::string& name, PlaneKind kind, const Eigen::Vector3d& corner, const Eigen::Vector3d& edge1,
                const Eigen::Vector3d& edge2) {
  ScanPlane p;
  p.name = name;
  p.kind = kind;
  p.u = edge1.normalized();
  p.v = edge2.normalized();
  p.normal = p.u.cross(p.v);
  p.offset_m = p.normal.dot(corner);
  const Eigen::Vector2d low(p.u.dot(corner), p.v.dot(corner)), size(edge1.norm(), edge2.norm());
  p.outline = {low, low + Eigen::Vector2d(size.x(), 0), low + size, low + Eigen::Vector2d(0, size.y())};
  p.area_m2 = p.covered_m2 = size.x() * size.y();
  p.rms_m = 0.003;
  p.bow_m = 0.001;
  return p;
}

void addRectangle(ScanActor& actor, const Eigen::Vector3d& a, const Eigen::Vector3d& edge1,
                  const Eigen::Vector3d& edge2) {
  const int base = static_cast<int>(actor.vertices.size());
  for (const Eigen::Vector3d& v :
       {a, Eigen::Vector3d(a + edge1), Eigen::Vector3d(a + edge1 + edge2), Eigen::Vector3d(a + edge2)}) {
    actor.vertices.push_back(v);
  }
  actor.triangles.push_back({base, base + 1, base + 2});
  actor.triangles.push_back({base, base + 2, base + 3});
}

/// Triangles and samples of a plane that is a rectangle, and the plane itself.
void addPlane(ScanScene& scene, const ScanPlane& p) {
  const Eigen::Vector2d size = p.outline[2] - p.outline[0];
  ScanActor actor;
  actor.name = p.name;
  addRectangle(actor, p.at(p.outline[0]), size.x() * p.u, size.y() * p.v);
  std::mt19937 random(static_cast<unsigned>(scene.planes.size()));
  std::normal_distribution<double> noise(0, p.rms_m);
  ScanPlane with = p;
  for (double a = 0.02; a < size.x(); a += 0.04) {
    for (double b = 0.02; b < size.y(); b += 0.04) {
      const Eigen::Vector2d q = p.outline[0] + Eigen::Vector2d(a, b);
      const double off = noise(random);
      scene.samples.push_back((p.at(q) + off * p.normal).cast<float>());
      scene.sample_normals.push_back(p.normal.cast<float>());
      scene.sample_owner.push_back(static_cast<int>(scene.planes.size()));
      with.residuals.emplace_back(q.x(), q.y(), off);
    }
  }
  scene.planes.push_back(with);
  scene.actors.push_back(actor);
  scene.materials.push_back({p.name, "Concrete", false, 1, "test"});
}

/// A closed box as a thing. Its samples are those of the sides, unless it is to lie where the scan shows air.
void addThing(ScanScene& scene, const std::string& name, const Eigen::Vector3d& low, const Eigen::Vector3d& size,
              bool sampled = true) {
  ScanThing thing;
  thing.name = name;
  thing.klass = "cabinet";
  thing.shape = ThingShape::kBox;
  thing.watertight = true;
  thing.bounds = Eigen::AlignedBox3d(low, low + size);
  ScanActor actor;
  actor.name = name;
  const std::vector<Eigen::Vector3d> e = {{size.x(), 0, 0}, {0, size.y(), 0}, {0, 0, size.z()}};
  for (int k = 0; k < 3; ++k) {
    addRectangle(actor, low, e[(k + 1) % 3], e[k]);
    addRectangle(actor, low + e[(k + 2) % 3], e[k], e[(k + 1) % 3]);
  }
  // One vertex for each corner, so that the box is closed.
  std::vector<Eigen::Vector3d> corners;
  std::vector<int> number;
  for (const auto& v : actor.vertices) {
    const auto same =
        std::find_if(corners.begin(), corners.end(), [&](const auto& c) { return (c - v).norm() < 1e-9; });
    number.push_back(static_cast<int>(same - corners.begin()));
    if (same == corners.end()) corners.push_back(v);
  }
  for (auto& t : actor.triangles) {
    for (int& i : t) i = number[static_cast<std::size_t>(i)];
  }
  actor.vertices = corners;
  thing.vertices = actor.vertices;
  thing.triangles = actor.triangles;
  const int owner = static_cast<int>(scene.planes.size() + scene.things.size());
  for (double x = 0; sampled && x <= size.x(); x += 0.04) {
    for (double z = 0; z <= size.z(); z += 0.04) {
      for (const double y : {0.0, size.y()}) {
        scene.samples.push_back((low + Eigen::Vector3d(x, y, z)).cast<float>());
        scene.sample_normals.push_back(Eigen::Vector3f::UnitY());
        scene.sample_owner.push_back(owner);
      }
    }
  }
  scene.things.push_back(thing);
  scene.actors.push_back(actor);
  scene.materials.push_back({name, "Metal", false, 0.5, "test"});
}

/// Six planes; the south wall ends gap_m before the east wall.
ScanScene room(double gap_m = 0) {
  ScanScene scene;
  const double x = kRoom.x(), y = kRoom.y(), z = kRoom.z();
  scene.frame.has_ceiling = true;
  scene.frame.ceiling_m = z;
  scene.frame.spacing_m = 0.04;
  addPlane(scene, plane("floor", PlaneKind::kFloor, {0, 0, 0}, {x, 0, 0}, {0, y, 0}));
  addPlane(scene, plane("ceiling", PlaneKind::kCeiling, {0, 0, z}, {0, y, 0}, {x, 0, 0}));
  addPlane(scene, plane("wall_1", PlaneKind::kWall, {0, 0, 0}, {0, 0, z}, {x - gap_m, 0, 0}));
  addPlane(scene, plane("wall_2", PlaneKind::kWall, {0, y, 0}, {x, 0, 0}, {0, 0, z}));
  addPlane(scene, plane("wall_3", PlaneKind::kWall, {0, 0, 0}, {0, y, 0}, {0, 0, z}));
  addPlane(scene, plane("wall_4", PlaneKind::kWall, {x, 0, 0}, {0, 0, z}, {0, y, 0}));
  return scene;
}

TEST(ScanQuality, AClosedRoomIsClean) {
  ScanScene scene = room();
  addThing(scene, "cabinet_1", {3.9, 3.4, 0.01}, {0.8, 0.5, 1.8});
  const ScanQuality quality = checkScanScene(scene);
  EXPECT_EQ(quality.places, 200u);
  EXPECT_EQ(quality.rays, 200u * 64u);
  EXPECT_EQ(quality.through_gaps, 0u);
  EXPECT_EQ(quality.through_openings, 0u);
  EXPECT_TRUE(quality.clean());
  EXPECT_TRUE(qualityNotes(quality).empty());
}

TEST(ScanQuality, FindsAGapOfThreeCentimetresAndSaysWhere) {
  const ScanQuality quality = checkScanScene(room(0.03));
  EXPECT_GT(quality.through_gaps, 0u);
  EXPECT_EQ(quality.through_openings, 0u);
  ASSERT_FALSE(quality.gaps.empty());
  EXPECT_NEAR(quality.gaps[0].at.x(), kRoom.x() - 0.015, 0.1);
  EXPECT_NEAR(quality.gaps[0].at.y(), 0, 0.1);
  ASSERT_EQ(qualityNotes(quality).size(), 1u);
}

TEST(ScanQuality, ARoomWithoutCeilingIsOpenAndHasNoGap) {
  ScanScene scene = room();
  scene.actors[1].vertices.assign(4, Eigen::Vector3d::Zero());
  addRectangle(scene.actors[1], {0, 0, 0}, {0.3, 0, 0}, {0, 0.3, 0});  // lies on the floor
  scene.actors[1].triangles.erase(scene.actors[1].triangles.begin(), scene.actors[1].triangles.begin() + 2);
  scene.frame.has_ceiling = false;
  const ScanQuality quality = checkScanScene(scene);
  EXPECT_GT(quality.through_openings, 1000u);
  EXPECT_EQ(quality.through_gaps, 0u);
  ASSERT_EQ(quality.coincide.size(), 1u);
  EXPECT_NEAR(quality.coincide[0].second, 0.09, 1e-3);
}

TEST(ScanQuality, FindsABodyWhereTheScanShowsAir) {
  ScanScene scene = room();
  addThing(scene, "unknown_1", {1, 1, 0.2}, {2, 1.5, 1.9}, false);
  const ScanQuality quality = checkScanScene(scene);
  ASSERT_EQ(quality.bodies.size(), 1u);
  EXPECT_EQ(quality.bodies[0].first, "unknown_1");
  EXPECT_GT(quality.bodies[0].second, 10);
}

TEST(ScanQuality, FindsFacesThatCoincideAndSlivers) {
  ScanScene scene = room();
  addPlane(scene, plane("panel_1", PlaneKind::kPanel, {0, 1, 0.3}, {0, 0.8, 0}, {0, 0, 1.5}));  // lies in wall_3
  addThing(scene, "strip_1", {3, 3.5, 0.3}, {0.6, 0.002, 1.5});
  const ScanQuality quality = checkScanScene(scene);
  ASSERT_EQ(quality.coincide.size(), 1u);
  EXPECT_NE(quality.coincide[0].first.find("wall_3"), std::string::npos);
  EXPECT_NEAR(quality.coincide[0].second, 0.8 * 1.5, 0.01);
  ASSERT_EQ(quality.slivers.size(), 1u);
  EXPECT_EQ(quality.slivers[0].first, "strip_1");
  EXPECT_EQ(quality.slivers[0].second, 2);
}

/// The level of a mirror with random heights of rms 1 mm alike within 0.5 m, by geometrical optics of its curvature at
/// the foot of the perpendicular, drawn as a sum of waves.
TEST(ScanQuality, ExpectedLevelErrorIsThatOfARandomMirror) {
  ScanScene scene = room();
  const ScanQuality quality = checkScanScene(scene);
  ASSERT_EQ(quality.expected.size(), 4u);
  const PathExpectation& e = quality.expected[0];
  EXPECT_DOUBLE_EQ(e.range_m, 0.001);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0, 2 * M_PI);
  const double length_m = 0.5, rms_m = 0.001, range_m = kExpectedRange_m;
  double square = 0;
  const int draws = 4000, waves = 60;
  for (int i = 0; i < draws; ++i) {
    Eigen::Matrix2d bend = Eigen::Matrix2d::Zero();
    for (int w = 0; w < waves; ++w) {
      // The spectrum of exp(-(r/L)^2) is normal with a variance of 2/L^2 on each axis.
      const Eigen::Vector2d k = std::sqrt(2.0) / length_m * Eigen::Vector2d(normal(random), normal(random));
      bend -= rms_m * std::sqrt(2.0 / waves) * std::cos(phase(random)) * k * k.transpose();
    }
    const double level_db = -10 * std::log10((Eigen::Matrix2d::Identity() + range_m * bend).determinant());
    square += level_db * level_db;
  }
  // The two axes' curvatures go together by a third.
  const double measured_db = std::sqrt(square / draws);
  EXPECT_NEAR(e.level_db / measured_db, 1, 0.2) << measured_db;
}

TEST(ScanQuality, WritesNumbersAndPictures) {
  ScanScene scene = room();
  addThing(scene, "cabinet_1", {3.9, 3.4, 0.01}, {0.8, 0.5, 1.8});
  const std::string folder = testing::TempDir() + "scan_quality_test";
  std::filesystem::create_directories(folder);
  writeScanQuality(scene, checkScanScene(scene), folder);
  std::ifstream file(folder + "/quality.yaml");
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_NE(text.str().find("through_gaps: 0\n"), std::string::npos);
  EXPECT_NE(text.str().find("level_db"), std::string::npos);
  for (const char* name : {"top_view.png", "residuals.png", "before_after.png"}) {
    const cv::Mat picture = cv::imread(folder + "/" + name);
    ASSERT_FALSE(picture.empty()) << name;
    cv::Mat gray, ink;
    cv::extractChannel(picture, gray, 1);
    EXPECT_GT(cv::countNonZero(gray < 245), 2000) << name;
  }
  EXPECT_THROW(writeScanQuality(scene, ScanQuality(), folder + "/absent"), std::runtime_error);
}

}  // namespace
}  // namespace mmradartwin
