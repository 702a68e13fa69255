#include "diagnosis/search/hypothesis_screen.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

NamedParameters reflectivity(const std::string& material, double delta_db) {
  NamedParameters m = mechanismWith("material_reflectivity", {{"delta_db", delta_db}});
  m.values.set("material", material);
  return m;
}

NamedParameters moved(const std::string& actor, double dx_m, double dy_m) {
  NamedParameters m = mechanismWith("actor_moved", {{"dx_m", dx_m}, {"dy_m", dy_m}});
  m.values.set("actor", actor);
  return m;
}

TEST(HypothesisScreen, SuspectsAreThoseWithTheLargestErrors) {
  MadeRoom room(4);
  room.measure(firstOrder());
  FittedRoom fitted(room, firstOrder());
  SessionLatents& latents = fitted.null.latents;
  const LatentSpread spread = fitted.model.spread();
  latents.actor_gain = {spread.actor_gain, 0, -2 * spread.actor_gain, 0};
  latents.actor_range_m = {0, 0, 3 * spread.actor_range_m, 0};
  const auto suspects = HypothesisScreen(fitted.source, fitted.model).suspects(fitted.null);
  ASSERT_EQ(suspects.size(), 3U);
  EXPECT_EQ(suspects[0].first, 2);
  EXPECT_NEAR(suspects[0].second, 0.5 * (4 + 9), 1e-9);
  EXPECT_EQ(suspects[1].first, 0);
  EXPECT_NEAR(suspects[1].second, 0.5, 1e-9);
}

TEST(HypothesisScreen, AnActorFartherAwayIsLikelierThere) {
  MadeRoom room(8);
  std::vector<NamedParameters> truth = firstOrder();
  truth.push_back(moved("east", 0.14, 0));
  room.measure(truth);
  FittedRoom fitted(room, firstOrder());
  const auto shifts = HypothesisScreen(fitted.source, fitted.model).nearerOrFarther(fitted.null, fitted.everyPose());
  ASSERT_EQ(shifts.size(), 3U);
  EXPECT_EQ(room.twin->scene().actors[static_cast<std::size_t>(shifts[0].actor)].name, "east");
  EXPECT_DOUBLE_EQ(shifts[0].shift_m, 0.14);
  EXPECT_GT(shifts[0].nats, 20);
  EXPECT_LT(shifts[1].nats, 0.2 * shifts[0].nats);
}

TEST(HypothesisScreen, AMaterialThatReflectsLessIsPromisedItsLevel) {
  MadeRoom room(8);
  std::vector<NamedParameters> truth = firstOrder();
  truth.push_back(reflectivity("Plate", -5));
  room.measure(truth);
  FittedRoom fitted(room, firstOrder());
  // As if its actor had no gain of its own that could stand in for it, and levels were known as usual.
  SessionLatents latents = fitted.null.latents;
  latents.actor_gain[1] = 0;
  latents.log_spread = SessionLatents().log_spread;
  fitted.null.latents = latents;
  fitted.null.log_likelihood = fitted.model.logLikelihood(fitted.null.echoes, latents, &fitted.null.by_pose);
  fitted.null.basis = fitted.model.basis(fitted.null.echoes, latents);
  fitted.null.covariance = fitted.model.covariance(fitted.null.echoes, latents, fitted.everyPose());
  HypothesisScreen screen(fitted.source, fitted.model);
  const Screened plate = screen.screen(fitted.null, reflectivityOf("Plate"), fitted.everyPose());
  const Screened metal = screen.screen(fitted.null, reflectivityOf("Metal"), fitted.everyPose());
  const double start_db = plate.hypothesis.at(plate.starts[0]).values.number("delta_db");
  EXPECT_LT(start_db, -0.5);
  EXPECT_GT(start_db, -10);
  EXPECT_GT(plate.screened_nats, 1);
  // With a gain of the session that nobody knows, all else may as well reflect more.
  EXPECT_GT(metal.hypothesis.at(metal.starts[0]).values.number("delta_db"), 0.5);
}

TEST(HypothesisScreen, WhatIsThereOrNotIsLookedAtDirectly) {
  MadeRoom room(8);
  std::vector<NamedParameters> truth = firstOrder();
  NamedParameters absent = defaultMechanism("actor_absent");
  absent.values.set("actor", std::string("north"));
  truth.push_back(absent);
  room.measure(truth);
  FittedRoom fitted(room, firstOrder());
  HypothesisScreen screen(fitted.source, fitted.model);
  const auto promised = [&](const std::string& actor) {
    return screen.screen(fitted.null, hypothesisOf("actor_absent", {}, "actor", actor), fitted.everyPose())
        .screened_nats;
  };
  EXPECT_GT(promised("north"), 10);
  EXPECT_EQ(promised("east"), 0);
}

TEST(HypothesisScreen, AnActorIsFoundAroundItsPlace) {
  MadeRoom room(8);
  std::vector<NamedParameters> truth = firstOrder();
  truth.push_back(moved("east", 0.2, 0));
  room.measure(truth);
  FittedRoom fitted(room, firstOrder());
  const Hypothesis move = hypothesisOf(
      "actor_moved", {{"dx_m", "m", -1, 0, 0.05, -3, 3, {}}, {"dy_m", "m", -1, 0, 0.05, -3, 3, {}}}, "actor", "east");
  const int east = room.twin->scene().actorIndex("east");
  const Screened found =
      HypothesisScreen(fitted.source, fitted.model).around(fitted.null, move, east, fitted.everyPose());
  EXPECT_GT(found.screened_nats, 20);
  EXPECT_NEAR(found.hypothesis.at(found.starts[0]).values.number("dx_m"), 0.2, 0.04);
}

TEST(HypothesisScreen, OfSeveralStartsTheBestComeFirst) {
  MadeRoom room(6);
  std::vector<NamedParameters> truth = firstOrder();
  truth.push_back(moved("east", 0.2, 0));
  room.measure(truth);
  FittedRoom fitted(room, firstOrder());
  const Hypothesis move = hypothesisOf("actor_moved", {{"dx_m", "m", -1, 0, 0.05, -3, 3, {}}}, "actor", "east");
  std::vector<std::vector<double>> starts;
  for (double x : {-4.0, -2.0, 0.5, 4.0, 8.0, 1.0, 2.0, -1.0}) starts.push_back({x});
  const Screened best =
      HypothesisScreen(fitted.source, fitted.model).amongStarts(fitted.null, {move, 0, starts}, fitted.everyPose());
  EXPECT_EQ(best.starts.size(), 6U);
  EXPECT_DOUBLE_EQ(best.starts[0][0], 4.0);  // 4 times 5 cm
  EXPECT_GT(best.screened_nats, 0);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
