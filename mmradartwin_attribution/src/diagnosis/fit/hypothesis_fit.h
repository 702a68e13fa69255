#pragma once

#include <cstddef>
#include <vector>

#include "diagnosis/catalogue/stated_bounds.h"
#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::fit {

/// State of the model: mechanisms, their echoes, and the latents fitted to the session.
struct ModelState {
  std::vector<NamedParameters> mechanisms;
  std::vector<double> actor_range_m;  ///< [actors] one-way ranges about which the echoes were collected
  std::vector<PoseEchoes> echoes;
  SessionLatents latents;
  double log_likelihood = 0;
  std::vector<double> by_pose;
  // Derivatives at the latents; only HypothesisFitter::state() fills them.
  Basis basis;
  SessionCovariance covariance;
};

/// Fit of one hypothesis, with all latents refitted.
struct HypothesisFit {
  Hypothesis hypothesis;
  StatedBounds stated;                ///< says which moves exceed the scene's errors
  std::vector<double> scaled_values;  ///< [coordinates] at the fit
  ModelState state;                   ///< without its echoes
  double gain = 0;                    ///< nats over the state without the hypothesis
  /// Gain in nats without the place that gains most. A path that only one place sees is evidence of no cause.
  double gain_without_best_place = 0;
  double overdispersion = 1;  ///< variance of the scores over places, divided by what the likelihood expects
  double false_alarm_rate =
      1;                     ///< family-wise: of the best of all hypotheses tried; small where the gain is overwhelming
  double held_out_gain = 0;  ///< nats on places that the fit did not see; each fold's values are one step from the fit
  std::vector<double> standard_error;  ///< [coordinates] of the values in their units, from the scatter over locations
  std::vector<std::vector<double>> fold_scaled;  ///< [folds][coordinates] values fitted without each fold of locations
  /// True where gain_without_best_place is far above that of clean sessions. The scatter over places is then ignored.
  bool overwhelming = false;
  std::size_t numbers() const;  ///< numbers that were fitted or searched for, at least one
  double ranking() const;       ///< gain, or a law's share of it that is ranked, less a price per number
  double moved_m() const;       ///< shift of an actor, or of all; 0 where none moves
  bool isFarAway() const;  ///< the actor moves much farther than the scene's errors, and the likelihood gains by it
  double size_m() const;   ///< size of an object that the twin lacks; 0 for other hypotheses
};

constexpr int kLatentSteps = 3;  ///< Fisher steps of the latents before starts or places are compared

/// Indices of all poses of the session.
std::vector<int> everyPose(const ModelState& state);
/// Indices of `wanted` of so many poses, or of all where there are fewer, evenly spread.
std::vector<int> evenlySpread(std::size_t poses, std::size_t wanted);

/// Hypothesis that was judged without a fit.
struct Screened {
  Hypothesis hypothesis;
  double screened_nats = 0;  ///< screened gain: nats over the overdispersion, with few or no latents refitted
  std::vector<std::vector<double>> starts;  ///< [starts][coordinates] scaled values from which a fit starts
};

}  // namespace mmradartwin::diagnosis::fit
