#include "diagnosis/fit/likelihood_climb.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

class ClimbInARoom : public ::testing::Test {
 protected:
  void measure(const NamedParameters& effect) {
    room_.measure({firstOrder()[0], effect});
    fitted_.emplace(room_, firstOrder());
  }
  Optimum climb(const Hypothesis& hypothesis, const std::vector<std::vector<double>>& starts,
                const HypothesisFit* known = nullptr) {
    const std::vector<Hypothesis> parts = {hypothesis};
    return LikelihoodClimb(fitted_->source, fitted_->model,
                           {base_, fitted_->null.latents, parts, starts, 4, &fitted_->null, 0, known})
        .run();
  }
  MadeRoom room_{10};
  std::optional<FittedRoom> fitted_;
  const std::vector<NamedParameters> base_ = firstOrder();
  const Hypothesis drift_ = hypothesisOf("gain_drift", {{"db_per_hour", "dB/h", -1, 0, 5, -1000, 1000, {}}});
};

TEST_F(ClimbInARoom, TakesTheBestOfSeveralStarts) {
  measure(mechanismWith("gain_drift", {{"db_per_hour", 80.0}}));
  const Optimum one = climb(drift_, {{16.0}}), several = climb(drift_, {{-40.0}, {16.0}, {90.0}});
  EXPECT_NEAR(several.scaled_values[0], one.scaled_values[0], 0.5);
  EXPECT_NEAR(several.state.log_likelihood, one.state.log_likelihood, 0.3);
}

TEST_F(ClimbInARoom, FindsAPlaceToMillimetresWhereSlopesEndEarlier) {
  NamedParameters moved = mechanismWith("actor_moved", {{"dx_m", 0.15}, {"dy_m", 0.0}});
  moved.values.set("actor", std::string("east"));
  measure(moved);
  const Hypothesis move = hypothesisOf("actor_moved", {{"dx_m", "m", -1, 0, 0.05, -3, 3, {}}}, "actor", "east");
  const Optimum o = climb(move, {{1.5}});
  EXPECT_NEAR(0.05 * o.scaled_values[0], 0.15, 0.02);
}

// The likelihood of a bias has a mode for each range bin that an echo may be shifted to.
TEST(Climb, LeavesAModeThatIsBinsAwayFromTheTruth) {
  RadarConfig radar = paperRadar();
  radar.samples_per_chirp = 256;
  MadeRoom room(5, threeCupboards(), radar);
  const double truth_m = 0.3, start_m = 0.1, bin_m = radar.range_bin_m();
  ASSERT_GT(truth_m - start_m, 5 * bin_m);
  room.measure({firstOrder()[0], mechanismWith("range_bias", {{"range_m", truth_m}})});
  FittedRoom fitted(room, firstOrder());
  const std::vector<NamedParameters> base = firstOrder();
  const std::vector<Hypothesis> parts = {hypothesisOf("range_bias", {{"range_m", "m", -1, 0, 0.02, -5, 5, {}}})};
  const std::vector<std::vector<double>> starts = {{start_m / 0.02}};
  const Optimum o =
      LikelihoodClimb(fitted.source, fitted.model, {base, fitted.null.latents, parts, starts, 4, &fitted.null}).run();
  EXPECT_NEAR(0.02 * o.scaled_values[0], truth_m, 0.2 * bin_m);
  EXPECT_GT(o.state.log_likelihood, fitted.null.log_likelihood + 20);
}

TEST(Gain, WithoutTheBestPlaceIsThatOfTheOthers) {
  ChannelData data;
  data.locations = {"a", "b", "c"};
  for (int location : {0, 0, 1, 2}) data.poses.emplace_back().location = location;
  ModelState null, state;
  null.by_pose = {1, 1, 1, 1};
  state.by_pose = {3, 4, 0, 3};
  null.log_likelihood = 4;
  state.log_likelihood = 10.5;  // its latents are half a nat nearer to what is usual
  EXPECT_EQ(gainByLocation(data, null, state), (std::vector<double>{5, -1, 2}));
  EXPECT_DOUBLE_EQ(gainWithoutBestPlace(data, null, state), 1.5);
  // A place that loses takes nothing off.
  state.by_pose = {0, 0, 0, 0};
  state.log_likelihood = 0;
  EXPECT_DOUBLE_EQ(gainWithoutBestPlace(data, null, state), -4);
  // One place has no others.
  data.locations = {"a"};
  for (PoseChannels& p : data.poses) p.location = 0;
  state.log_likelihood = 9;
  EXPECT_DOUBLE_EQ(gainWithoutBestPlace(data, null, state), 5);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
