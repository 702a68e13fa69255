#include "diagnosis/search/back_projection.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

/// Adds a point's echo to a pose by hand: a tone of this amplitude at the range of the point, `behind_m` late.
void addPoint(MadeRoom& room, std::size_t pose, const Eigen::Vector2d& place, double behind_m, double amplitude) {
  const RadarConfig& radar = room.data.radar;
  const Eigen::Vector3d p = room.data.poses[pose].pose.T_map_radar.inverse() * Eigen::Vector3d(place.x(), place.y(), 0);
  if (p.x() <= 0.1) return;
  PathRecord r;
  for (int k = 0; k < radar.channels(); ++k) {
    r.length_m.push_back(2 * (p.norm() + behind_m) - radar.virtual_element_m(k).y() * p.y() / p.norm());
  }
  setContribution(radar, amplitude, r);
  ComplexGrid x = ComplexGrid::Zero(radar.channels(), radar.samples_per_chirp);
  accumulate(radar, {r}, x);
  room.data.poses[pose].range_spectra += SignalChain(radar).rangeSpectra(x) / (0.5 * radar.samples_per_chirp);
}

TEST(BackProjection, FindsACylinderThatTheTwinLacks) {
  MadeRoom room(12);
  room.measure(firstOrder());
  const Eigen::Vector2d place(2.45, 0.75);
  const double radius_m = 0.15;
  for (std::size_t i = 0; i < room.data.poses.size(); ++i) {
    const double r = (room.data.poses[i].pose.T_map_radar.translation().head<2>() - place).norm() - radius_m;
    const double amplitude = room.data.radar.wavelength_m() / (8 * M_PI * r) * std::sqrt(radius_m / (radius_m + r));
    addPoint(room, i, place, -radius_m, amplitude);
  }
  FittedRoom fitted(room, firstOrder());
  const std::vector<ProjectedPlace> places = projectBack(*room.twin, fitted.model, fitted.null);
  ASSERT_FALSE(places.empty());
  EXPECT_NEAR(places[0].x_m, place.x(), 0.11);
  EXPECT_NEAR(places[0].y_m, place.y(), 0.11);
  EXPECT_NEAR(places[0].size_m, 2 * radius_m, 0.2);
  EXPECT_GT(places[0].screened_nats, 50);
  // The best ones lie apart.
  for (std::size_t i = 1; i < places.size(); ++i) {
    EXPECT_GT(std::hypot(places[i].x_m - places[0].x_m, places[i].y_m - places[0].y_m), 0.49);
  }
}

TEST(BackProjection, FindsAPointThatAnswersLate) {
  MadeRoom room(12);
  room.measure(firstOrder());
  const Eigen::Vector2d place(1.9, -1.1);
  for (std::size_t i = 0; i < room.data.poses.size(); ++i) {
    const double r = (room.data.poses[i].pose.T_map_radar.translation().head<2>() - place).norm();
    const double rcs_m2 = std::pow(10.0, -0.5);
    addPoint(room, i, place, 1.2, room.data.radar.wavelength_m() * std::sqrt(rcs_m2 / std::pow(4 * M_PI, 3)) / (r * r));
  }
  FittedRoom fitted(room, firstOrder());
  const std::vector<ProjectedPlace> places = projectLateBack(*room.twin, fitted.model, fitted.null);
  ASSERT_FALSE(places.empty());
  EXPECT_NEAR(places[0].x_m, place.x(), 0.3);
  EXPECT_NEAR(places[0].y_m, place.y(), 0.3);
  EXPECT_NEAR(places[0].behind_m, 1.2, 0.25);
  EXPECT_EQ(places[0].rcs_dbsm, -5);
}

TEST(BackProjection, FindsASideThatFewPosesFace) {
  MadeRoom room(12);
  room.measure(firstOrder());
  const Eigen::Vector2d place(2.45, 0.75);
  const std::vector<int> faced = {1, 5, 8};
  for (const int i : faced) {
    const auto pose = static_cast<std::size_t>(i);
    const double r = (room.data.poses[pose].pose.T_map_radar.translation().head<2>() - place).norm();
    addPoint(room, pose, place, 0, room.data.radar.wavelength_m() / (8 * M_PI * r));
  }
  FittedRoom fitted(room, firstOrder());
  const std::vector<ProjectedPlace> places = projectSidesBack(*room.twin, fitted.model, fitted.null);
  ASSERT_FALSE(places.empty());
  EXPECT_NEAR(places[0].x_m, place.x(), 0.11);
  EXPECT_NEAR(places[0].y_m, place.y(), 0.11);
  EXPECT_GT(places[0].screened_nats, 10);
  std::vector<int> told(places[0].faced.begin(), places[0].faced.begin() + 3);
  std::sort(told.begin(), told.end());
  EXPECT_EQ(told, faced);
}

TEST(BackProjection, IsSilentAboutARoomThatIsAsTheTwinHasIt) {
  MadeRoom room(12);
  room.measure(firstOrder());
  FittedRoom fitted(room, firstOrder());
  for (const ProjectedPlace& p : projectBack(*room.twin, fitted.model, fitted.null)) EXPECT_LT(p.screened_nats, 10);
  for (const ProjectedPlace& p : projectSidesBack(*room.twin, fitted.model, fitted.null)) EXPECT_LT(p.screened_nats, 8);
}

TEST(BackProjection, AnObjectsPlaceAndSizeAreThoseOfItsHypothesis) {
  ProjectedPlace place;
  place.x_m = 1.25;
  place.y_m = -0.75;
  place.size_m = 0.3;
  const Hypothesis object = objectAt(place);
  const NamedParameters typical = object.at({1});
  EXPECT_DOUBLE_EQ(typical.values.number("x_m"), 1.25);
  EXPECT_DOUBLE_EQ(typical.values.number("y_m"), -0.75);
  EXPECT_DOUBLE_EQ(typical.values.number("size_m"), 0.3);
  place.behind_m = 0.9;
  place.rcs_dbsm = -5;
  const NamedParameters late = lateEchoAt(place).at({1});
  EXPECT_DOUBLE_EQ(late.values.number("behind_m"), 0.9);
  EXPECT_NEAR(late.values.number("rcs_dbsm"), -5, 1e-9);
}

TEST(BackProjection, AFreedPlaceStartsWhereItWasAndBehindIt) {
  ChannelData data;
  data.radar = paperRadar();
  for (double y : {-1.0, 1.0})
    data.poses.emplace_back().pose.T_map_radar = Eigen::Isometry3d(Eigen::Translation3d(0, y, 0));
  ProjectedPlace place;
  place.x_m = 2;
  place.size_m = 0.3;
  Screened object{objectAt(place), 0, {{1.0}}};
  EXPECT_NEAR((awayFromRadar(data, {2, 0}) - Eigen::Vector2d(1, 0)).norm(), 0, 1e-12);
  freePlace(data, object);
  ASSERT_EQ(object.starts.size(), 3U);
  const NamedParameters same = object.hypothesis.at(object.starts[0]), wide = object.hypothesis.at(object.starts[2]);
  EXPECT_DOUBLE_EQ(same.values.number("x_m"), 2);
  EXPECT_DOUBLE_EQ(same.values.number("size_m"), 0.3);
  // Something wide stands behind the place, its front there.
  EXPECT_NEAR(wide.values.number("x_m") - 0.5 * wide.values.number("size_m"), 2, 1e-9);
  EXPECT_NEAR(wide.values.number("y_m"), 0, 1e-9);
  Screened late{lateEchoAt(place), 0, {{1.0}}};
  freePlace(data, late);
  ASSERT_EQ(late.starts.size(), 1U);
  EXPECT_EQ(late.starts[0].size(), 4U);
}

TEST(BackProjection, NearObjectsAreThoseThatCanBeMoved) {
  Scene scene;
  const auto add = [&](double x0, double x1, bool present) {
    Actor actor;
    actor.bounds = Eigen::AlignedBox3d(Eigen::Vector3d(x0, 0, 0), Eigen::Vector3d(x1, 1, 1));
    actor.present = present;
    scene.actors.push_back(actor);
  };
  add(1.5, 2, true);     // 0.5 m away
  add(3.2, 4, true);     // 0.2 m away
  add(2.5, 3.1, false);  // is not there
  add(3.1, 9, true);     // too large to move
  add(4.0, 5, true);     // too far
  EXPECT_EQ(objectsNear(scene, 3.0 - 0.5, 0.5), (std::vector<int>{0}));
  EXPECT_EQ(objectsNear(scene, 3.0, 0.5), (std::vector<int>{1}));
  EXPECT_EQ(objectsNear(scene, 2.7, 0.5), (std::vector<int>{1}));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
