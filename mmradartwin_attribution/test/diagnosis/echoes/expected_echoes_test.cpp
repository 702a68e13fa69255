#include "diagnosis/echoes/expected_echoes.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>

#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis {
namespace {

/// A metal cabinet with its front in the plane x = 3 m, 1 m wide.
class CabinetScene : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "mmradartwin_test_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    std::ofstream(folder_ + "/materials.yaml") << "materials:\n  Metal: {model: conductor}\n";
    std::ofstream(folder_ + "/scene.yaml") << "meshes: [{file: cabinet.obj}]\nmaterials: materials.yaml\n";
    std::ofstream obj(folder_ + "/cabinet.obj");
    obj << "o cabinet\nusemtl Metal\n";
    for (const char* z : {"-2", "2"}) {
      for (const char* xy : {"3 -0.5 ", "4 -0.5 ", "4 0.5 ", "3 0.5 "}) obj << "v " << xy << z << "\n";
    }
    obj << "f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  }
  /// A second one to the left, its front in the plane y = 2 m.
  void addLocker() const {
    std::ofstream obj(folder_ + "/cabinet.obj", std::ios::app);
    obj << "o locker\nusemtl Metal\n";
    for (const char* z : {"-2", "2"}) {
      for (const char* xy : {"-0.5 2 ", "0.5 2 ", "0.5 3 ", "-0.5 3 "}) obj << "v " << xy << z << "\n";
    }
    obj << "f 9 10 11 12\nf 13 14 15 16\nf 9 10 14 13\nf 10 11 15 14\nf 11 12 16 15\nf 12 9 13 16\n";
  }
  /// Of radars at such a place and heading.
  static ChannelData atPoses(const std::vector<Eigen::Isometry3d>& T_map_radar) {
    ChannelData data;
    data.radar = paperRadar();
    for (const Eigen::Isometry3d& T : T_map_radar) data.poses.emplace_back().pose.T_map_radar = T;
    return data;
  }
  Twin twinFor(const ChannelData& data) const { return Twin(loadTwin("", folder_ + "/scene.yaml", data.radar)); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string folder_;
};

/// Of all channels, and of all bins or one.
double power(const std::vector<std::shared_ptr<const EchoGroup>>& groups, int channels,
             std::optional<int> bin = std::nullopt) {
  double sum = 0;
  for (const auto& group : groups) {
    const EchoGroup::Fields& bins = group->bins;
    const std::size_t size = static_cast<std::size_t>(channels * (channels + 1) / 2);
    for (int b = bins.first; b < bins.first + bins.cells; ++b) {
      if (bin && b != *bin) continue;
      for (int k = 0; k < channels; ++k) sum += bins.at(b, size)->power[k * (k + 3) / 2].real();
    }
  }
  return sum;
}

double power(const PoseEchoes& echoes, int channels, std::optional<int> bin = std::nullopt) {
  return power(echoes.groups, channels, bin);
}

// Paths are traced one mechanism at a time, but an edge that a specular return holds is no path of the whole twin.
TEST_F(CabinetScene, ExpectsOfEdgesWhatTheWholeTwinHas) {
  // The front is square on and holds both of its edges; then no face is.
  const ChannelData data =
      atPoses({Eigen::Isometry3d(Eigen::Translation3d(1, 0, 0)),
               Eigen::Translation3d(1, -2.5, 0) * Eigen::AngleAxisd(0.25 * M_PI, Eigen::Vector3d::UnitZ())});
  const Twin twin = twinFor(data);
  ExpectedEchoes source(twin, data, PoseAccuracy());
  const NamedParameters specular = defaultMechanism("specular"), edges = defaultMechanism("edge_diffraction");
  const std::vector<PoseEchoes> without = source.echoes({specular}), with = source.echoes({specular, edges});
  const Twin whole = twin.changed({specular, edges});
  const auto tracedPower = [&](std::size_t pose, const std::string& event) {
    double sum = 0;
    for (const PathRecord& r : whole.trace(data.poses[pose].pose.T_map_radar)) {
      if (*r.event == event) sum += r.amplitude * r.amplitude;
    }
    return sum;
  };
  const auto addedPower = [&](std::size_t pose) { return power(with[pose], 8) - power(without[pose], 8); };
  // The window's power in a cell is the same for all paths.
  const double cell = power(without[0], 8) / tracedPower(0, "specular");
  EXPECT_EQ(tracedPower(0, "edge_diffraction"), 0);
  EXPECT_NEAR(addedPower(0) / power(without[0], 8), 0, 1e-6);
  ASSERT_GT(tracedPower(1, "edge_diffraction"), 0);
  EXPECT_NEAR(addedPower(1) / (cell * tracedPower(1, "edge_diffraction")), 1, 0.02);
}

// The echo of each of two objects is its own, whatever one hides of the other and of the room.
TEST_F(CabinetScene, ExpectsOfTwoObjectsWhatTheWholeTwinHas) {
  const ChannelData data = atPoses({Eigen::Isometry3d::Identity()});
  const Twin twin = twinFor(data);
  const NamedParameters specular = defaultMechanism("specular");
  const auto object = [](double x_m, double y_m, const std::string& shape) {
    NamedParameters m = defaultMechanism("actor_unmodelled");
    m.values.set("x_m", x_m);
    m.values.set("y_m", y_m);
    m.values.set("size_m", 0.3);
    m.values.set("bottom_m", -1.0);
    m.values.set("shape", shape);
    return m;
  };
  const std::string round = "cylinder", box = "box";
  for (const auto& objects : {std::vector<NamedParameters>{object(2, 0.5, round), object(2, -0.5, round)},
                              {object(1.5, 0, round), object(2.5, 0, round)},
                              {object(2, 0.6, box), object(2, 0, round)},
                              {object(2, 0, round), object(2, 0.6, box)}}) {
    std::vector<NamedParameters> all = objects;
    all.push_back(specular);
    ExpectedEchoes source(twin, data, PoseAccuracy());
    double expected = 0;
    for (const PathRecord& r : twin.changed(all).trace(data.poses[0].pose.T_map_radar))
      expected += r.amplitude * r.amplitude;
    // The window's power in a cell is the same for all paths.
    double alone = 0;
    for (const PathRecord& r : twin.changed({specular}).trace(data.poses[0].pose.T_map_radar))
      alone += r.amplitude * r.amplitude;
    const double cell = power(source.echoes({specular})[0], 8) / alone;
    EXPECT_NEAR(power(source.echoes(all)[0], 8) / (cell * expected), 1, 0.02);
  }
}

// An edge that the radar stands before within the accuracy of its pose makes an echo uncertain, wherever it is that
// a hypothesis puts the radar.
TEST_F(CabinetScene, ExpectsEchoesThatAPosesErrorMayBring) {
  const ChannelData data = atPoses({Eigen::Isometry3d::Identity()});
  const Twin twin = twinFor(data);
  const NamedParameters specular = defaultMechanism("specular");
  ExpectedEchoes source(twin, data, PoseAccuracy());
  source.setBaseline({specular});
  NamedParameters offset = defaultMechanism("radar_position_offset");
  const auto beside = [&](double left_m) {
    offset.values.set("left_m", left_m);
    return source.echoes({specular, offset})[0];
  };
  EXPECT_TRUE(source.echoes({specular})[0].pose_sensitive.empty());
  const PoseEchoes off = beside(0.503);
  ASSERT_EQ(off.pose_sensitive.size(), 1);
  EXPECT_EQ(twin.scene().actors[static_cast<std::size_t>(off.pose_sensitive[0]->actors[0])].name, "cabinet");
  // The shadow of an edge at a metre is some centimetres wide at this wavelength: 1 cm takes a part, rarely.
  EXPECT_GT(power(off.pose_sensitive, 8), 1e-3 * power(off, 8));
  // It is weighed as the echo itself is.
  NamedParameters darker = defaultMechanism("material_reflectivity");
  darker.values.set("actor", std::string("cabinet"));
  darker.values.set("delta_db", -10.0);
  const PoseEchoes dark = source.echoes({specular, offset, darker})[0];
  EXPECT_NEAR(power(dark.pose_sensitive, 8) / power(off.pose_sensitive, 8), 0.1, 1e-6);
}

// A square law makes echoes of two at the sum of their ranges, four times as strong as those of each at twice its own.
TEST_F(CabinetScene, ExpectsWhatAReceiverMakesOfTwoEchoesTogether) {
  addLocker();
  const ChannelData data = atPoses({Eigen::Isometry3d(Eigen::AngleAxisd(0.25 * M_PI, Eigen::Vector3d::UnitZ()))});
  Twin twin = twinFor(data);
  twin.setStrongestAmplitude(1e-4);
  ExpectedEchoes source(twin, data, PoseAccuracy());
  NamedParameters specular = defaultMechanism("specular"), harmonic = defaultMechanism("second_harmonic");
  specular.values.set("max_bounces", 1.0);
  harmonic.values.set("level_db", -20.0);
  const std::vector<NamedParameters> mixing = {specular, harmonic};
  const Simulation whole = twin.changed(mixing).simulate(data.poses[0].pose.T_map_radar);
  const Eigen::MatrixXcd spectra = SignalChain(data.radar).rangeSpectra(whole.grid.x) / (0.5 * whole.grid.x.cols());
  const std::vector<PoseEchoes> first = source.echoes(mixing);
  for (double range_m : {2.0, 3.0, 4.0, 5.0, 6.0}) {
    const int bin = static_cast<int>(std::lround(range_m / data.radar.range_bin_m()));
    EXPECT_NEAR(power(first[0], 8, bin) / spectra.col(bin).squaredNorm(), 1, 0.05) << range_m << " m";
  }
  // What was kept of it is the same, whatever was tried in between.
  harmonic.values.set("level_db", -10.0);
  EXPECT_GT(power(source.echoes({specular, harmonic})[0], 8), 1.0001 * power(first[0], 8));
  EXPECT_DOUBLE_EQ(power(source.echoes(mixing)[0], 8), power(first[0], 8));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
