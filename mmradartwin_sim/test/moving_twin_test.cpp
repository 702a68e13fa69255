#include "mmradartwin_sim/moving_twin.h"

#include <algorithm>
#include <random>

#include "mmradartwin_dsp/input_error.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;
using Complex = std::complex<double>;

constexpr double kDegree = M_PI / 180;
const char* const kBase = "  specular: {}\n  corner: {}\n  diffuse: {}\n  edge_diffraction: {level: 1}\n";

/// A room, and two things in it whose meshes are files of their own: a crate about its own origin and a door.
class MovingTwinTest : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    addWall("south", "RoughConcrete", {0, 0}, {6, 0}, 0, 2.8);
    addWall("north", "RoughConcrete", {0, 5}, {6, 5}, 0, 2.8);
    addWall("west", "RoughConcrete", {0, 0}, {0, 5}, 0, 2.8);
    addWall("east", "RoughMetal", {6, 0}, {6, 5}, 0, 2.8);
    addBox("cabinet", "RoughMetal", V(4.6, 4.4, 0), V(5.8, 4.9, 1.6));
    writeScene("room");
    addBox("crate", "RoughMetal", V(-0.3, -0.2, 0), V(0.3, 0.2, 1.5));
    writeScene("crate");
    addWall("door", "RoughConcrete", {0, 0}, {0, 0.9}, 0, 2);
    writeScene("door");
  }
  static std::string placement(const Eigen::Vector3d& at, double yaw_deg) {
    std::ostringstream text;
    text << std::setprecision(17) << "xyz_m: [" << at.x() << ", " << at.y() << ", " << at.z() << "], rpy_deg: [0, 0, "
         << yaw_deg << "]";
    return text.str();
  }
  static Eigen::Isometry3d standing(const Eigen::Vector3d& at, double yaw_deg) {
    return Eigen::Translation3d(at) * Eigen::AngleAxisd(yaw_deg * kDegree, V::UnitZ());
  }
  /// The scene file in which crate and door stand so.
  std::string scene(const V& crate, double crate_deg, const V& door, double door_deg) const {
    write("scene.yaml", "meshes:\n  - {file: room.obj}\n  - {file: crate.obj, " + placement(crate, crate_deg) +
                            "}\n  - {file: door.obj, " + placement(door, door_deg) + "}\nmaterials: materials.yaml\n");
    return path("scene.yaml");
  }
  /// Both grids are the same, and so are the paths but for their order.
  static void expectAlike(const Simulation& is, const Simulation& expected, const std::string& what) {
    EXPECT_LT((is.grid.x - expected.grid.x).norm(), 1e-9 * expected.grid.x.norm()) << what;
    const auto keys = [](const Simulation& s) {
      std::vector<std::pair<std::string, PerInteraction<int>>> keys;
      for (const PathRecord& r : s.records) keys.emplace_back(*r.event, r.facets);
      std::sort(keys.begin(), keys.end());
      return keys;
    };
    std::ostringstream differing;
    const auto list = [&](const Simulation& one, const Simulation& other) {
      const auto a = keys(one), b = keys(other);
      decltype(keys(one)) only;
      std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(only));
      for (const auto& [event, facets] : only) {
        differing << ' ' << event << " of";
        for (int f : facets) differing << ' ' << f;
      }
    };
    list(is, expected);
    differing << '|';
    list(expected, is);
    EXPECT_EQ(differing.str(), "|") << what;
    EXPECT_TRUE(is.check.ok()) << what;
  }
};

// Against a twin that is made anew of a scene file which says where crate and door stand.
TEST_F(MovingTwinTest, IsTheTwinOfTheSceneInWhichActorsStandThere) {
  struct Step {
    V crate;
    double crate_deg;
    V door;
    double door_deg;
    const char* what;
  };
  const Step first = {V(3, 4, 0), 10, V(5.9, 1, 0), 0, "as the scene has it"};
  const std::vector<Step> steps = {{V(4, 2.6, 0), 10, V(5.9, 1, 0), 0, "the crate hides the east wall"},
                                   {V(4, 2.6, 0), 55, V(5.9, 1, 0), 0, "the crate turns"},
                                   {V(4, 2.6, 0), 55, V(5.9, 1, 0), 70, "the door opens"},
                                   {V(2.9, 2.2, 0.2), -30, V(5.9, 1, 0), 35, "both move, the crate near the radar"},
                                   {V(9, 9, 0), 0, V(5.9, 1, 0), 35, "the crate leaves the room"},
                                   {V(3, 4, 0), 10, V(5.9, 1, 0), 0, "back"}};
  const Eigen::Isometry3d radar = radarPose(2, 2.5, 1, 10);
  for (const std::string& more :
       {std::string(),
        std::string("  tx_rx_leakage: {range_m: 0.6, level_db: -3}\n  if_highpass: {corner_hz: 500.0e+3}\n"
                    "  material_reflectivity: {material: RoughMetal, delta_db: -3}\n"
                    "  element_pattern: {cos_exponent: 2}\n  tx_imbalance: {phase_deg: 20}\n"),
        std::string("  second_harmonic: {level_db: -30}\n  transmission: {actor: crate, one_way_db: -3}\n"
                    "  wall_ghost: {walls: [east]}\n"),
        std::string(
            "  echo_replica: {behind_m: 0.4, level_db: -8, actor: crate}\n  if_highpass: {corner_hz: 500.0e+3}\n")}) {
    const auto at = [&](const Step& s) {
      Twin twin = makeTwin(scene(s.crate, s.crate_deg, s.door, s.door_deg), kBase + more);
      twin.setStrongestAmplitude(1e-3);
      return twin;
    };
    MovingTwin moving(at(first), {"crate", "door"});
    expectAlike(moving.simulate(radar), at(first).simulate(radar), more + first.what);
    const std::size_t all = moving.found();
    for (const Step& s : steps) {
      moving.place("crate", standing(s.crate, s.crate_deg));
      moving.place("door", standing(s.door, s.door_deg));
      expectAlike(moving.simulate(radar), at(s).simulate(radar), more + s.what);
      EXPECT_LT(moving.found(), all) << s.what;
    }
    EXPECT_EQ(moving.counts().traced, 1u);
    EXPECT_EQ(moving.counts().updated, steps.size());
    // The radar moves too.
    moving.place("crate", standing(steps[0].crate, steps[0].crate_deg));
    const Eigen::Isometry3d elsewhere = radarPose(3, 1.5, 1.1, 70);
    expectAlike(moving.simulate(elsewhere), at(steps[0]).simulate(elsewhere), more + "elsewhere");
    EXPECT_EQ(moving.counts().traced, 2u);
  }
}

TEST_F(MovingTwinTest, TracesNothingWhereNothingMoves) {
  const std::string file = scene(V(3, 4, 0), 10, V(5.9, 1, 0), 0);
  MovingTwin moving(makeTwin(file, kBase), {"crate"});
  const ComplexGrid first = moving.simulate(radarPose(2, 2.5, 1, 10), 5).grid.x;
  moving.place("crate", standing(V(3, 4, 0), 10));
  const Simulation& again = moving.simulate(radarPose(2, 2.5, 1, 10), 6);
  EXPECT_EQ(again.grid.x, first);
  EXPECT_EQ(again.stamp_ns, 6);
  EXPECT_EQ(moving.found(), 0u);
  EXPECT_EQ(moving.counts().reused, 1u);
}

// Many moves: differences do not add up to an error, and two runs have the same bits.
TEST_F(MovingTwinTest, StaysExactOverManyFrames) {
  const std::string file = scene(V(3, 4, 0), 10, V(5.9, 1, 0), 0);
  MovingTwin a(makeTwin(file, kBase), {"crate"}), b(makeTwin(file, kBase), {"crate"});
  const Eigen::Isometry3d radar = radarPose(2, 2.5, 1, 10);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Isometry3d T = standing(V(3.5 + std::cos(0.1 * i), 2.5 + std::sin(0.1 * i), 0), 3 * i);
    a.place("crate", T);
    b.place("crate", T);
    a.simulate(radar);
    ASSERT_EQ(a.simulate(radar).grid.x, b.simulate(radar).grid.x) << i;
  }
  const Eigen::Isometry3d last = standing(V(3, 4, 0), 10);
  a.place("crate", last);
  expectAlike(a.simulate(radar), makeTwin(file, kBase).simulate(radar), "back after 200 moves");
}

// 4 pi v T/lambda from frame to frame, by all scatter points of a plate alike: phases stay with the points.
TEST_F(MovingTwinTest, EchoesOfAMovingActorAreCoherent) {
  const std::string file = scene(V(3.5, 2.5, 0), 5, V(5.9, 1, 0), 0);
  Twin twin = makeTwin(file, "  diffuse: {}\n", radarAt77GHz());
  MovingTwin moving(twin, {"crate"});
  const auto echoes = [&](double further_m) {
    moving.place("crate", standing(V(3.5 + further_m, 2.5, 0), 5));
    std::vector<PathRecord> ours;
    for (const PathRecord& r : moving.simulate(radarPose(0.5, 2.5, 1)).records) {
      if (twin.scene().actors[static_cast<std::size_t>(r.actors[0])].name == "crate") ours.push_back(r);
    }
    std::sort(ours.begin(), ours.end(), [](const auto& x, const auto& y) {
      return std::make_pair(x.vertices[0].z(), x.vertices[0].y()) <
             std::make_pair(y.vertices[0].z(), y.vertices[0].y());
    });
    return ours;
  };
  const double step_m = 0.0004, wavenumber = 2 * M_PI * 77e9 / kSpeedOfLight_m_per_s;
  std::vector<PathRecord> before = echoes(0);
  ASSERT_GT(before.size(), 20u);
  for (int frame = 1; frame <= 5; ++frame) {
    const std::vector<PathRecord> now = echoes(frame * step_m);
    ASSERT_EQ(now.size(), before.size());
    for (std::size_t i = 0; i < now.size(); ++i) {
      const V toward = (before[i].vertices[0] - V(0.5, 2.5, 1)).normalized();
      const double expected = 2 * wavenumber * step_m * toward.x();
      EXPECT_NEAR(std::remainder(std::arg(now[i].c[0] / before[i].c[0]) - expected, 2 * M_PI), 0, 2e-3);
    }
    before = now;
  }
}

// Instances answer as one tree of the moved scene does.
TEST_F(MovingTwinTest, RaysMeetActorsWhereTheyStand) {
  const Scene before = loadScene(scene(V(3, 4, 0), 10, V(5.9, 1, 0), 0), 77e9);
  const int crate = before.actorIndex("crate");
  RayCaster instances(before, {crate});
  const Eigen::Isometry3d moved = standing(V(2.2, 1.4, 0.1), 130) * standing(V(3, 4, 0), 10).inverse();
  instances.place(crate, moved);
  const Scene after = loadScene(scene(V(2.2, 1.4, 0.1), 130, V(5.9, 1, 0), 0), 77e9);
  const RayCaster tree(after);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(0.2, 5.8), y(0.2, 4.8), z(0.1, 2.6);
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const V a(x(random), y(random), z(random)), b(x(random), y(random), z(random));
    EXPECT_EQ(instances.visible(a, b), tree.visible(a, b)) << a.transpose() << " to " << b.transpose();
    const auto one = instances.firstHit(a, b - a, 100), other = tree.firstHit(a, b - a, 100);
    ASSERT_EQ(one.has_value(), other.has_value());
    if (!one) continue;
    EXPECT_EQ(one->actor, other->actor);
    EXPECT_EQ(one->facet, other->facet);
    EXPECT_NEAR(one->distance_m, other->distance_m, 1e-5);
    hits += one->actor == crate;
  }
  EXPECT_GT(hits, 20);
  EXPECT_EQ(instances.insideActor(V(2.2, 1.4, 0.8)), crate);
  EXPECT_FALSE(instances.insideActor(V(3, 4, 0.8)));
  EXPECT_THROW(instances.place(0, moved), std::invalid_argument);
}

TEST_F(MovingTwinTest, SaysWhatCannotMove) {
  const std::string file = scene(V(3, 4, 0), 10, V(5.9, 1, 0), 0);
  const Twin twin = makeTwin(file, kBase);
  EXPECT_NE(errorOf([&] { MovingTwin(twin, {"dog"}); }).find("dog"), std::string::npos);
  MovingTwin moving(twin, {"crate"});
  EXPECT_NE(errorOf([&] { moving.place("door", standing(V(0, 0, 0), 0)); }).find("door"), std::string::npos);
  EXPECT_NE(errorOf([&] { moving.place("crate", standing(V(NAN, 0, 0), 0)); }).find("not a number"), std::string::npos);
  // A crate that is set down upon the radar is named; when it goes on, the twin goes on.
  const Eigen::Isometry3d radar = radarPose(2, 2.5, 1, 10);
  const ComplexGrid first = moving.simulate(radar).grid.x;
  moving.place("crate", standing(V(2, 2.5, 0), 0));
  EXPECT_NE(errorOf([&] { moving.simulate(radar); }).find("crate"), std::string::npos);
  moving.place("crate", standing(V(3, 4, 0), 10));
  EXPECT_LT((moving.simulate(radar).grid.x - first).norm(), 1e-9 * first.norm());
}

}  // namespace
}  // namespace mmradartwin
