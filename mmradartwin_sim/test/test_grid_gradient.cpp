#include "mmradartwin_sim/grid_gradient.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

/// Gradients against differences of grids that twins with that mechanism simulate from the start.
class GridGradientTest : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    addWall("wall", "RoughConcrete", {5, -3}, {5, 3});
    addWall("side", "Metal", {5, 3}, {-1, 3});
    addWall("plate", "Metal", {3, -1.2}, {3.3, -0.8}, -0.3, 0.3);
    scene_ = writeScene();
    base_ = simulate("");
  }
  Simulation simulate(const std::string& mechanism) const {
    return makeTwin(scene_, "  specular: {}\n  corner: {}\n  diffuse: {}\n" + mechanism)
        .simulate(radarPose(0, 0, 0, 10));
  }
  /// Central difference by a mechanism's parameter.
  ComplexGrid difference(const std::string& mechanism, const std::string& key, double step) const {
    const auto at = [&](double value) {
      std::ostringstream line;
      line << std::setprecision(17) << "  " << mechanism << ": {" << key << ": " << value << "}\n";
      return simulate(line.str()).grid.x;
    };
    return (at(step) - at(-step)) / (2 * step);
  }
  static double misfit(const ComplexGrid& is, const ComplexGrid& should) {
    return (is - should).norm() / should.norm();
  }
  std::string scene_;
  Simulation base_;
};

TEST_F(GridGradientTest, IsTheDifferenceByBiasAndScale) {
  const RadarConfig radar = paperRadar();
  const GridGradient gradient(radar, base_.records);
  EXPECT_LT(misfit(gradient.byRangeBias_per_m(), difference("range_bias", "range_m", 1e-7)), 1e-5);
  EXPECT_LT(misfit(gradient.byRangeScale(), difference("range_scale", "scale", 1e-6)), 1e-5);
}

TEST_F(GridGradientTest, IsTheDifferenceByYawInTheArraysFarField) {
  const RadarConfig radar = paperRadar();
  // The phase origin of the array stays; 1 cm of array at 2 m and more leaves some parts in a thousand.
  EXPECT_LT(misfit(GridGradient(radar, base_.records).byYaw_per_rad(),
                   difference("radar_yaw_offset", "yaw_deg", 1e-4) * (180 / M_PI)),
            0.01);
}

TEST_F(GridGradientTest, IsTheDifferenceByLevelAndChannelPhase) {
  const RadarConfig radar = paperRadar();
  const GridGradient gradient(radar, base_.records);
  EXPECT_LT(misfit(gradient.byWeight_per_db(), (base_.grid.x * (std::pow(10, 1e-5 / 20) - 1)) / 1e-5), 1e-5);
  const ComplexGrid turned = simulate("  channel_phase_error: {phase_deg: [0, 0, 0.001, 0, 0, 0, 0, 0]}\n").grid.x;
  EXPECT_LT(misfit(gradient.byChannelPhase_per_rad(2), (turned - base_.grid.x) * (180 / M_PI / 0.001)), 1e-4);
  EXPECT_THROW(gradient.byChannelPhase_per_rad(8), std::invalid_argument);
}

}  // namespace
}  // namespace mmradartwin
