#pragma once

#include <cstddef>
#include <vector>

#include "diagnosis/catalogue/stated_bounds.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::fit {

/// State of the model: mechanisms, their echoes, and latents fitted to the session.
struct ModelState {
  std::vector<NamedParameters> mechanisms;
  std::vector<double> actor_range_m;  ///< ranges about which the echoes were collected
  std::vector<PoseEchoes> echoes;
  SessionLatents nuisance;
  double log_likelihood = 0;
  std::vector<double> by_pose;
  // Derivatives at nuisance; only HypothesisFitter::state() fills them.
  Basis basis;
  SessionCovariance covariance;
};

/// Fit of one hypothesis, with everything else refitted.
struct HypothesisFit {
  Hypothesis hypothesis;
  StatedBounds stated;                ///< which moves are larger than the scene's errors
  std::vector<double> scaled_values;  ///< [coordinates] at the fit
  ModelState state;                   ///< echoes left out
  double gain = 0;                    ///< nats over the state without it
  /// Gain without the place that gains most. A path that one place sees and the twin just hides is no cause.
  double gain_without_best_place = 0;
  double overdispersion = 1;           ///< variance of the scores over places against what the likelihood expects
  double false_alarm_rate = 1;         ///< family-wise: of the best of all hypotheses tried; small where plain
  double held_out_gain = 0;            ///< nats on places that the fit did not see, each fold by one step from the fit
  std::vector<double> standard_error;  ///< [coordinates] of the values (not scaled), from the scatter over locations
  std::vector<std::vector<double>> fold_scaled;  ///< [folds][coordinates] values without each fold of locations
  /// True where gain_without_best_place is far beyond what clean sessions bring, whatever the scatter over places.
  bool plain = false;
  std::size_t numbers() const;  ///< how many were fitted or searched for, at least one
  double ranking() const;       ///< gain, or the ranked share of it, less a price per number
  double moved_m() const;       ///< how far it moves an actor, or all of them; 0 where it moves none
  bool isFarAway() const;       ///< moves much farther than an actor's place is wrong by, and gains by it
  double size_m() const;        ///< of an object that the twin lacks; 0 for all others
};

constexpr int kSettling = 3;  ///< Fisher steps of the latents before one of several starts or places is judged

/// Indices of all poses of the session.
std::vector<int> everyPose(const ModelState& state);

/// Hypothesis that was looked at without a fit.
struct Screened {
  Hypothesis hypothesis;
  double screened_nats = 0;                 ///< promised nats over the overdispersion, little or nothing refitted
  std::vector<std::vector<double>> starts;  ///< scaled coordinates to start a fit from
};

}  // namespace mmradartwin::diagnosis::fit
