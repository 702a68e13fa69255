#include <tbb/global_control.h>

#include "closed_form.h"
#include "mmradartwin_sim/cell_records.h"
#include "mmradartwin_sim/traced_session.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;

class TracedSessionTest : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    addWall("south", "RoughConcrete", {0, 0}, {6, 0}, 0, 2.8);
    addWall("north", "RoughConcrete", {0, 5}, {6, 5}, 0, 2.8);
    addWall("west", "RoughMetal", {0, 0}, {0, 5}, 0, 2.8);
    addWall("east", "RoughConcrete", {6, 0}, {6, 5}, 0, 2.8);
    addBox("cabinet", "Metal", V(4.6, 4.4, 0), V(5.8, 4.9, 1.6));
    scene_ = writeScene();
    for (int i = 0; i < 3; ++i) {
      Pose pose;
      pose.name = std::to_string(i);
      pose.stamp_ns = i * 1000000000LL;
      pose.T_map_radar = radarPose(2 + 0.7 * i, 2.5, 1, 30 + 100 * i);
      poses_.push_back(pose);
    }
  }
  Twin twin(const std::string& mechanisms = "") const {
    return makeTwin(scene_,
                    "  specular: {}\n  corner: {}\n  diffuse: {}\n  edge_diffraction: {level: 1}\n" + mechanisms);
  }
  /// Largest relative difference of a pose's grid, weighed again against simulated from the start.
  double worst(const TracedSession& session, const std::string& mechanisms) const {
    Twin other = twin(mechanisms);
    other.setSession(poses_);
    double worst = 0;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      const ComplexGrid again = session.weigh(other, i).grid.x;
      const ComplexGrid fresh = other.simulate(poses_[i].T_map_radar, poses_[i].stamp_ns).grid.x;
      worst = std::max(worst, (again - fresh).norm() / fresh.norm());
    }
    return worst;
  }
  std::string scene_;
  std::vector<Pose> poses_;
};

TEST_F(TracedSessionTest, WeighsMaterialsChannelsAndGainAsIfTracedAgain) {
  const TracedSession session(twin(), poses_);
  EXPECT_TRUE(session.problems().empty());
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    EXPECT_GT(session.trace(i).nodes().size(), 20u);
    EXPECT_LT(session.trace(i).nodes().size() + session.trace(i).records().size(),
              twin().trace(poses_[i].T_map_radar).size());
  }
  for (const char* mechanisms :
       {"", "  material_reflectivity: {material: RoughConcrete, delta_db: -7}\n",
        "  material_reflectivity: {actor: west, delta_db: 4}\n",
        "  surface_roughness: {material: RoughMetal, roughness_rms_m: 0.0002}\n",
        "  channel_phase_error: {phase_deg: [0, 10, 20, 30, 40, 50, 60, 70]}\n  gain_drift: {db_per_hour: 30}\n",
        "  tx_rx_leakage: {range_m: 0.6, level_db: -3}\n", "  range_bias: {range_m: 0.05}\n",
        "  echo_replica: {behind_m: 0.1, level_db: -6}\n",
        "  echo_replica: {behind_m: 0.1, level_db: -6, actor: west}\n"}) {
    // What lengthens a path turns its phase with a term in delay times length, which differs within a node by some
    // 1e-5 rad.
    EXPECT_LT(worst(session, mechanisms), std::string(mechanisms).find("_m: 0.") == std::string::npos ? 1e-6 : 1e-4)
        << mechanisms;
  }
}

TEST_F(TracedSessionTest, InterpolatesPatternsBetweenItsNodes) {
  const std::string pattern = "  element_pattern: {cos_exponent: 2.1}\n",
                    filter = "  if_highpass: {corner_hz: 500.0e+3}\n";
  CondensedTrace::Options fine;
  fine.azimuth_step_deg = 1;
  fine.elevation_step_deg = 2;
  fine.length_step_m = 0.2;
  const TracedSession coarse(twin(), poses_), close(twin(), poses_, fine);
  EXPECT_LT(worst(coarse, pattern), 3e-3);
  EXPECT_LT(worst(coarse, filter), 2e-2);
  EXPECT_LT(worst(close, pattern), 0.2 * worst(coarse, pattern)) << "falls with the steps";
  EXPECT_LT(worst(close, filter), 0.5 * worst(coarse, filter));
}

TEST_F(TracedSessionTest, DoesNotDependOnThreads) {
  const Twin base = twin();
  const TracedSession many(base, poses_);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const TracedSession alone(base, poses_);
  for (std::size_t i = 0; i < poses_.size(); ++i) EXPECT_EQ(many.weigh(base, i).grid.x, alone.weigh(base, i).grid.x);
  EXPECT_EQ(many.bytes(), alone.bytes());
}

TEST_F(TracedSessionTest, SaysWhatItCannotWeigh) {
  poses_[1].T_map_radar = radarPose(5, 4.6, 1);
  const TracedSession session(twin(), poses_);
  ASSERT_EQ(session.problems().size(), 1u);
  EXPECT_NE(session.problems()[0].message.find("cabinet"), std::string::npos);
  EXPECT_FALSE(session.usable(1));
  EXPECT_NE(errorOf([&] { session.weigh(twin(), 1); }).find("not traced"), std::string::npos);
  addWall("wall", "Metal", {3, -3}, {3, 3});
  const Twin elsewhere = makeTwin(writeScene("other"));
  EXPECT_NE(errorOf([&] { session.weigh(elsewhere, 0); }).find("another scene"), std::string::npos);
}

// Meta-tests of the simulator as a whole, on the same room.
TEST_F(TracedSessionTest, ReciprocityTransmittersAndReceiversMaySwap) {
  RadarConfig there = paperRadar(), back = there;
  there.tx_position_m = {{0, 0.02, 0}, {0, -0.05, 0}};
  back.tx_position_m = there.rx_position_m;
  back.rx_position_m = there.tx_position_m;
  const std::string mechanisms = "  specular: {}\n  corner: {}\n  diffuse: {}\n  edge_diffraction: {level: 1}\n";
  const Twin a = makeTwin(scene_, mechanisms, there), b = makeTwin(scene_, mechanisms, back);
  for (const Pose& pose : poses_) {
    const ComplexGrid x = a.simulate(pose.T_map_radar).grid.x, y = b.simulate(pose.T_map_radar).grid.x;
    ComplexGrid swapped = y;
    for (int t = 0; t < 2; ++t) {
      for (int r = 0; r < 4; ++r) swapped.row(4 * t + r) = y.row(2 * r + t);
    }
    expectForm("4.10 transmitters and receivers swapped, pose " + pose.name, "1", 0, (x - swapped).norm() / x.norm(),
               1e-6);
  }
}

// What is exported: fewer records of the same grid, whatever is weighed on them.
TEST_F(TracedSessionTest, CellsAreTheirPoints) {
  const std::string dense =
      "  specular: {}\n  corner: {}\n  edge_diffraction: {level: 1}\n  diffuse: {spacing_m: 0.04}\n";
  const Twin base = makeTwin(scene_, dense);
  for (const Pose& pose : poses_) {
    const Simulation s = base.simulate(pose.T_map_radar);
    const std::vector<PathRecord> cells = sumPerCell(base.radar(), s.records);
    EXPECT_LT(cells.size(), s.records.size() / 5) << "of " << s.records.size();
    ComplexGrid sum;
    accumulate(base.radar(), cells, sum);
    EXPECT_LT((sum - s.grid.x).norm(), 1e-7 * s.grid.x.norm());
    EXPECT_EQ(exportedRecords(base.radar(), s.records, DiffuseRecords::kPoints).size(), s.records.size());
    std::size_t others = 0;
    for (const PathRecord& r : cells) {
      double power = 0;
      for (const auto& c : r.c) power += std::norm(c);
      ASSERT_NEAR(power, 8 * r.amplitude * r.amplitude, 1e-12 * power);
      ASSERT_EQ(r.facets.size(), static_cast<std::size_t>(r.bounces));
      EXPECT_EQ(r.range_bin, rangeBin(base.radar(), r.length_m[0]));
      for (std::size_t i = 0; i < r.facets.size(); ++i) {
        const Facet& facet = base.scene().facets[static_cast<std::size_t>(r.facets[i])];
        EXPECT_EQ(facet.actor, r.actors[i]);
        EXPECT_LT(std::abs(facet.planeDistance(r.vertices[i])), 1e-6);
      }
      others += *r.event != "diffuse";
    }
    EXPECT_EQ(others, s.records.size() - of(s, "diffuse").size()) << "all else stays as it was";
    // Weighed: a material and an actor exactly, a pattern as far as a cell is wide.
    const auto weighed = [&](const std::string& mechanism) {
      const Twin other = makeTwin(scene_, dense + mechanism);
      const ComplexGrid fresh = other.simulate(pose.T_map_radar).grid.x;
      return (other.weigh(pose.T_map_radar, cells).grid.x - fresh).norm() / fresh.norm();
    };
    EXPECT_LT(weighed("  material_reflectivity: {material: RoughConcrete, delta_db: -7}\n"), 1e-6);
    EXPECT_LT(weighed("  material_reflectivity: {actor: west, delta_db: 4}\n"), 1e-6);
    EXPECT_LT(weighed("  channel_phase_error: {phase_deg: [0, 10, 20, 30, 40, 50, 60, 70]}\n"), 1e-6);
    EXPECT_LT(weighed("  element_pattern: {cos_exponent: 2.1}\n"), 0.05);
    double points = 0, summed = 0;
    for (const PathRecord& r : of(s, "diffuse")) points += r.amplitude * r.amplitude;
    for (const PathRecord& r : cells) summed += *r.event == "diffuse" ? r.amplitude * r.amplitude : 0;
    EXPECT_NEAR(10 * std::log10(summed / points), 0, 1.5) << "power too, as far as some hundred random sums tell";
  }
  // Few points stay points.
  const Simulation sparse = twin("  range_bias: {range_m: 0.01}\n").simulate(poses_[0].T_map_radar);
  EXPECT_LE(sumPerCell(base.radar(), sparse.records).size(), sparse.records.size());
  EXPECT_NE(errorOf([] { diffuseRecordsFrom("all", "--diffuse-records"); }).find("cells, points"), std::string::npos);
}

}  // namespace
}  // namespace mmradartwin
