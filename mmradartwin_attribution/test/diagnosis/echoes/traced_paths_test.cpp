#include "diagnosis/echoes/traced_paths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

NamedParameters absent(const std::string& actor) {
  NamedParameters m = defaultMechanism("actor_absent");
  m.values.set("actor", actor);
  return m;
}

NamedParameters cylinderAt(double x_m, double y_m) {
  return mechanismWith("actor_unmodelled", {{"x_m", x_m}, {"y_m", y_m}, {"size_m", 0.3}, {"bottom_m", -1.0}});
}

/// Amplitudes of paths, sorted.
std::vector<double> amplitudes(const std::vector<PathRecord>& records) {
  std::vector<double> all;
  for (const PathRecord& r : records) all.push_back(r.amplitude);
  std::sort(all.begin(), all.end());
  return all;
}

class TracedRoom : public ::testing::Test {
 protected:
  /// Paths of all mechanisms at a pose, traced one mechanism at a time.
  std::vector<PathRecord> pathsAt(const std::vector<NamedParameters>& mechanisms, std::size_t pose) {
    const std::vector<NamedParameters> geometry = traced_.geometryOf(mechanisms);
    std::vector<PathRecord> all;
    for (const NamedParameters& m : mechanisms) {
      const auto& paths = *traced_.of(geometry, m, mechanisms, traced_.everyPose())[pose];
      all.insert(all.end(), paths.begin(), paths.end());
    }
    return all;
  }
  void expectWholeTwin(const std::vector<NamedParameters>& mechanisms) {
    const Twin whole = room_.twin->changed(mechanisms);
    for (std::size_t i = 0; i < room_.data.poses.size(); ++i) {
      const std::vector<double> got = amplitudes(pathsAt(mechanisms, i)),
                                want = amplitudes(whole.trace(room_.data.poses[i].pose.T_map_radar));
      ASSERT_EQ(got.size(), want.size()) << "pose " << i;
      for (std::size_t k = 0; k < got.size(); ++k) EXPECT_NEAR(got[k], want[k], 1e-6 * want[k]) << "pose " << i;
    }
  }

  MadeRoom room_{6};
  TracedPaths traced_{*room_.twin, room_.data, 0.004};
};

TEST_F(TracedRoom, PathsOneMechanismAtATimeAreThoseOfTheWholeTwin) { expectWholeTwin(firstOrder()); }

TEST_F(TracedRoom, AnEditOfAKnownGeometryHasThePathsOfItsWholeTwin) {
  expectWholeTwin(firstOrder());
  for (const NamedParameters& edit : {absent("north"), cylinderAt(2, 0.5)}) {
    std::vector<NamedParameters> mechanisms = firstOrder();
    mechanisms.push_back(edit);
    expectWholeTwin(mechanisms);
  }
}

TEST_F(TracedRoom, WhatOnlyWeighsTracesNothing) {
  NamedParameters darker = mechanismWith("material_reflectivity", {{"delta_db", -10.0}});
  darker.values.set("material", std::string("Metal"));
  EXPECT_FALSE(traced_.altersGeometry(darker));
  EXPECT_TRUE(traced_.altersGeometry(absent("north")));
  const NamedParameters specular = firstOrder()[0];
  const auto before = traced_.of({}, specular, {specular}, {0, 1});
  const auto after = traced_.of({}, specular, {specular, darker}, {0, 1});
  EXPECT_EQ(before[0], after[0]);
  EXPECT_EQ(before[1], after[1]);
  EXPECT_EQ(after[2], nullptr);  // not asked for
}

TEST_F(TracedRoom, MechanismsThatTraceAlikeHaveOneKey) {
  NamedParameters bias = mechanismWith("range_bias", {{"range_m", 0.1}}), other = bias;
  NamedParameters replica = mechanismWith("echo_replica", {{"level_db", -10.0}});
  NamedParameters weaker = mechanismWith("echo_replica", {{"level_db", -20.0}});
  EXPECT_EQ(traceKeyOf({bias}), traceKeyOf({other}));
  EXPECT_EQ(traceKeyOf({replica}), traceKeyOf({weaker}));  // a level only weighs
  EXPECT_NE(traceKeyOf({cylinderAt(2, 0)}), traceKeyOf({cylinderAt(2.1, 0)}));
  EXPECT_NE(traceKeyOf({bias, replica}), traceKeyOf({replica, bias}));
}

TEST_F(TracedRoom, PlacedActorsAreTheLastOfAGeometry) {
  const std::vector<NamedParameters> mechanisms = {cylinderAt(2, 0.5), firstOrder()[0],
                                                   mechanismWith("radar_yaw_offset", {{"yaw_deg", 1.0}})};
  const std::vector<NamedParameters> geometry = traced_.geometryOf(mechanisms);
  ASSERT_EQ(geometry.size(), 2U);
  EXPECT_EQ(geometry[0].mechanism, "radar_yaw_offset");
  EXPECT_EQ(geometry[1].mechanism, "actor_unmodelled");
}

TEST_F(TracedRoom, ABaselineForgetsOtherPaths) {
  const NamedParameters specular = firstOrder()[0];
  const std::vector<NamedParameters> moved = {specular, cylinderAt(2, 0.5)};
  const std::weak_ptr<const TracedPaths::Paths> own = traced_.of({}, specular, {specular}, {0})[0];
  // A list that the edit changes is one of its own.
  const std::weak_ptr<const TracedPaths::Paths> other = traced_.of({moved[1]}, specular, moved, {0})[0];
  ASSERT_NE(own.lock(), other.lock());
  traced_.setBaseline({specular});
  EXPECT_TRUE(traced_.hasBaseline());
  EXPECT_FALSE(own.expired());
  EXPECT_TRUE(other.expired());
  traced_.clearBaseline();
  EXPECT_FALSE(traced_.hasBaseline());
}

TEST(TracedPaths, ARadarInsideSomethingSeesNothing) {
  MadeRoom room(1);
  room.data.poses[0].pose.T_map_radar = Eigen::Isometry3d::Identity();
  TracedPaths traced(*room.twin, room.data, 0.004);
  const std::vector<NamedParameters> mechanisms = {firstOrder()[0], cylinderAt(0, 0)};
  const auto& paths = traced.of(traced.geometryOf(mechanisms), mechanisms[0], mechanisms, {0});
  ASSERT_NE(paths[0], nullptr);
  EXPECT_TRUE(paths[0]->empty());
}

}  // namespace
}  // namespace mmradartwin::diagnosis
