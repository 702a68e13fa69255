#include "diagnosis/fit/profiled_values.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr double kLevel_db = -4;

/// A room with a material that reflects less, and the likelihood along that level by brute force.
class DarkPlate : public ::testing::Test {
 protected:
  void SetUp() override {
    std::vector<NamedParameters> truth = firstOrder();
    truth.push_back(reflectivityOf("Plate").at({kLevel_db / -3}));
    room_.measure(truth);
    fitted_.emplace(room_, firstOrder());
    latents_ = fitted_->null.latents;
    const auto echoes =
        fitted_->source.echoes(mechanismsWith(firstOrder(), {plate_}, {kLevel_db / -3}), latents_.actor_range_m);
    fitted_->model.fit(echoes, latents_, 20);
  }
  /// The likelihood with the level at a value of the scale and all latents refitted.
  double profileAt(double scaled) {
    const std::vector<NamedParameters> mechanisms = mechanismsWith(firstOrder(), {plate_}, {scaled});
    SessionLatents latents = latents_;
    const auto echoes = fitted_->source.echoes(mechanisms, latents.actor_range_m);
    return fitted_->model.fit(echoes, latents, 20);
  }
  ProfiledValues profiledFrom(double scaled, double standard_error_db) {
    return profiled(model(), {plate_}, {{scaled}, {standard_error_db}});
  }

  ProfiledModel model() { return {fitted_->source, fitted_->model, accuracy_, fitted_->null.mechanisms, latents_}; }

  const PoseAccuracy accuracy_;
  MadeRoom room_{10};
  std::optional<FittedRoom> fitted_;
  SessionLatents latents_;  ///< fitted with the material, as values are profiled after a joint fit
  const Hypothesis plate_ = reflectivityOf("Plate");
};

TEST_F(DarkPlate, ValuesMoveToTheTopOfTheLikelihood) {
  double best = -INFINITY, best_scaled = 0;
  for (double scaled = 0; scaled <= 3; scaled += 0.1) {
    const double value = profileAt(scaled);
    if (value > best) {
      best = value;
      best_scaled = scaled;
    }
  }
  for (double start : {best_scaled - 0.3, best_scaled + 0.3}) {
    const ProfiledValues result = profiledFrom(start, 0.8);
    EXPECT_GE(profileAt(result.scaled_values[0]), best - 0.5) << "from " << start;
  }
}

TEST_F(DarkPlate, ItsErrorIsAtLeastWhatTheLikelihoodsFallSays) {
  const ProfiledValues result = profiledFrom(1.3, 0.8);
  const double at = result.scaled_values[0], step = 1;  // falls by about a nat
  const double fall = profileAt(at) - 0.5 * (profileAt(at + step) + profileAt(at - step));
  const double by_fall_db = 3 * step / std::sqrt(2 * fall);
  EXPECT_GT(result.standard_error[0], 0.7 * by_fall_db);
  // An actor's own level is known to 1.5 dB before: its material's level is known to that at most.
  EXPECT_GT(result.standard_error[0], 1.4);
  EXPECT_LT(result.standard_error[0], 4);
  EXPECT_NEAR(-3 * at, kLevel_db, 3 * result.standard_error[0]);
}

TEST_F(DarkPlate, PartsWithTooManyNumbersStayAsTheyAre) {
  Hypothesis many = hypothesisOf("gain_drift", {});
  std::vector<ProfiledValues> fits = {{std::vector<double>(7, 0.5), std::vector<double>(7, 0.1)}};
  many.coordinates.resize(7);
  profileParts(model(), {many}, fits);
  EXPECT_EQ(fits[0].scaled_values, std::vector<double>(7, 0.5));
  EXPECT_EQ(fits[0].standard_error, std::vector<double>(7, 0.1));
}

TEST_F(DarkPlate, SeveralPartsAreProfiledTogether) {
  const Hypothesis drift = hypothesisOf("gain_drift", {{"db_per_hour", "dB/h", -1, 0, 5, -1000, 1000, {}}});
  std::vector<ProfiledValues> fits = {{{1.3}, {0.8}}, {{0.0}, {1.0}}};
  profileParts(model(), {plate_, drift}, fits);
  ASSERT_EQ(fits[0].scaled_values.size(), 1U);
  ASSERT_EQ(fits[1].scaled_values.size(), 1U);
  EXPECT_NEAR(-3 * fits[0].scaled_values[0], kLevel_db, 3 * fits[0].standard_error[0]);
  EXPECT_NEAR(5 * fits[1].scaled_values[0], 0, 3 * fits[1].standard_error[0] + 1);
}

TEST_F(DarkPlate, ATurnIsKnownToTheCommonErrorOfHeadings) {
  const Hypothesis yaw = hypothesisOf("radar_yaw_offset", {{"yaw_deg", "deg", -1, 0, 0.5, -180, 180, {}}});
  const ProfiledValues result = profiled(model(), {yaw}, {{0.0}, {0.05}});
  // Ten headings of 0.3 degrees each know no common turn to better than their mean.
  EXPECT_GT(result.standard_error[0], 0.5 * 0.3 / std::sqrt(10));
  EXPECT_LT(result.standard_error[0], 1);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
