#include "diagnosis/search/object_search.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"
#include "diagnosis/search/back_projection.h"

namespace mmradartwin::diagnosis {
namespace {

/// A cylinder as a fit has left it, and poses on a circle of 2 m about it.
class FittedCylinder : public ::testing::Test {
 protected:
  void SetUp() override {
    data_.radar = paperRadar();
    for (int i = 0; i < 9; ++i) {
      const double angle = 0.2 * i - 0.8;
      data_.poses.emplace_back().pose.T_map_radar =
          Eigen::Isometry3d(Eigen::Translation3d(3 - 2 * std::cos(angle), 1 - 2 * std::sin(angle), 0));
      null_.by_pose.push_back(0);
      fit_.state.by_pose.push_back(i == 2 ? 50 : i == 7 ? 40 : 1);
    }
    ProjectedPlace place;
    place.x_m = 3;
    place.y_m = 1;
    place.size_m = 0.2;
    Screened object{objectAt(place), 0, {{1.0}}};
    freePlace(data_, object);
    fit_.hypothesis = object.hypothesis;
    fit_.scaled_values = object.starts[0];
    fit_.gain = 77;
  }

  ChannelData data_;
  ModelState null_;
  HypothesisFit fit_;
};

TEST_F(FittedCylinder, BecomesABoxWhoseNearSideIsWhereItsFrontIs) {
  EXPECT_FALSE(isUnmodelledBox(fit_.hypothesis));
  const Screened box = asBox(data_, null_, fit_);
  EXPECT_TRUE(isUnmodelledBox(box.hypothesis));
  EXPECT_EQ(box.screened_nats, 77);
  ASSERT_GT(box.starts.size(), 10U);
  for (const std::vector<double>& start : box.starts) {
    const NamedParameters m = box.hypothesis.at(start);
    const Eigen::Vector2d from_axis(m.values.number("x_m") - 3, m.values.number("y_m") - 1);
    EXPECT_NEAR(from_axis.norm(), std::abs(0.1 - 0.5 * m.values.number("size_m")), 1e-9);
  }
}

TEST_F(FittedCylinder, BecomesABoxThatFacesThePosesThatGainMost) {
  const Screened box = asBox(data_, null_, fit_);
  for (std::size_t pose : {2U, 7U}) {
    const Eigen::Vector2d way = data_.poses[pose].pose.T_map_radar.translation().head<2>() - Eigen::Vector2d(3, 1);
    const double facing_deg = std::atan2(way.y(), way.x()) * 180 / M_PI;
    bool faces = false;
    for (const std::vector<double>& start : box.starts) {
      const NamedParameters m = box.hypothesis.at(start);
      const Eigen::Vector2d from_axis(m.values.number("x_m") - 3, m.values.number("y_m") - 1);
      const bool behind = from_axis.normalized().dot(way.normalized()) < -1 + 1e-9;
      faces = faces || (behind && std::abs(std::remainder(m.values.number("yaw_deg") - facing_deg, 90)) < 1e-6);
    }
    EXPECT_TRUE(faces) << "pose " << pose;
  }
}

TEST(BoxAbout, StandsAboutThePlaceThatPathsPass) {
  const Screened box = boxAbout({1.5, -0.5, 0.4, 20});
  EXPECT_TRUE(isUnmodelledBox(box.hypothesis));
  ASSERT_FALSE(box.starts.empty());
  for (const std::vector<double>& start : box.starts) {
    const NamedParameters m = box.hypothesis.at(start);
    EXPECT_LE(std::abs(m.values.number("x_m") - 1.5), 0.1 + 1e-9);
    EXPECT_LE(std::abs(m.values.number("y_m") + 0.5), 0.1 + 1e-9);
    EXPECT_GT(m.values.number("size_m"), 0.2);
  }
}

TEST_F(FittedCylinder, ABoxThatFacesAPoseHasASideAtThePlace) {
  ProjectedPlace side;
  side.x_m = 2.6;
  side.y_m = 1.1;
  side.faced = {4};
  const Screened box = boxFacing(data_, side);
  EXPECT_TRUE(isUnmodelledBox(box.hypothesis));
  ASSERT_FALSE(box.starts.empty());
  const Eigen::Vector2d radar = data_.poses[4].pose.T_map_radar.translation().head<2>(), seen(2.6, 1.1);
  const Eigen::Vector2d way = (radar - seen).normalized();
  for (const std::vector<double>& start : box.starts) {
    const NamedParameters m = box.hypothesis.at(start);
    const Eigen::Vector2d from_middle = seen - Eigen::Vector2d(m.values.number("x_m"), m.values.number("y_m"));
    EXPECT_NEAR(from_middle.dot(way), 0.5 * m.values.number("size_m"), 1e-9);
  }
}

TEST(FitObject, FindsAMovedCupboard) {
  MadeRoom room(8);
  std::vector<NamedParameters> truth = firstOrder();
  NamedParameters moved = mechanismWith("actor_moved", {{"dx_m", 0.17}, {"dy_m", 0}});
  moved.values.set("actor", std::string("east"));
  truth.push_back(moved);
  room.measure(truth);
  FittedRoom fitted(room, firstOrder());
  const Hypothesis move = hypothesisOf(
      "actor_moved", {{"dx_m", "m", -1, 0, 0.05, -3, 3, {}}, {"dy_m", "m", -1, 0, 0.05, -3, 3, {}}}, "actor", "east");
  const HypothesisFit fit = fitObject(fitted.fitter, fitted.null, {move, 30, {{2.0, 0.0}}});
  EXPECT_GT(fit.gain, 20);
  EXPECT_NEAR(fit.hypothesis.at(fit.scaled_values).values.number("dx_m"), 0.17, 0.03);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
