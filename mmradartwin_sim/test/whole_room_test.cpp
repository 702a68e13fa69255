#include "closed_form.h"
#include "mmradartwin_sim/cell_records.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;

/// A room with rough walls and a cabinet, seen from three poses, with all base mechanisms.
class WholeRoom : public SceneFiles {
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
  std::string scene_;
  std::vector<Pose> poses_;
};

TEST_F(WholeRoom, ReciprocityTransmittersAndReceiversMaySwap) {
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
TEST_F(WholeRoom, CellsAreTheirPoints) {
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
