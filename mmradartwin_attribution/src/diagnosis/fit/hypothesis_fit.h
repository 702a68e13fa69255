#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/likelihood/profiled_scores.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::fit {

/// A state of the model: mechanisms, what they make of the session, and everything else fitted to it.
struct ModelState {
  std::vector<NamedParameters> mechanisms;
  std::vector<double> actor_range_m;  ///< about which the echoes were taken
  std::vector<PoseEchoes> echoes;
  SessionLatents nuisance;
  double log_likelihood = 0;
  std::vector<double> by_pose;
  // At nuisance; filled by HypothesisFitter::state() alone:
  Basis basis;
  SessionCovariance covariance;
};

/// One hypothesis, all else refitted.
struct HypothesisFit {
  Hypothesis hypothesis;
  std::vector<double> scaled_values;   ///< of its coordinates
  ModelState state;                    ///< without its echoes
  double gain = 0;                     ///< nats over the state without it
  double gain_without_best_place = 0;  ///< the same without the place that gains most: a path that one place sees
                                       ///< and the twin hides by a hair is no cause
  double overdispersion = 1;           ///< of the scores' variance over places against what the likelihood expects
  double false_alarm_rate = 1;         ///< family-wise: of the best of all hypotheses that were tried; at most
                                       ///< 0.01 where it is plain
  double held_out_gain = 0;            ///< nats on places that the fit did not see, each fold by one step from the fit
  std::vector<double> standard_error;  ///< of the values (not scaled), by location
  std::vector<std::vector<double>> fold_scaled;  ///< coordinates without each fold of locations
  bool plain =
      false;  ///< gain_without_best_place is far beyond what clean sessions bring, whatever the scatter over places
  std::size_t numbers() const;  ///< fitted or searched for, at least one
  double ranking() const;       ///< gain less a price per number; of what bends to much, part of it
  double moved_m() const;       ///< how far it moves an actor, or all of them; 0 of what moves none
  bool isFarAway() const;       ///< moves much farther than an actor's place is wrong by, and gains by it
  double size_m() const;        ///< of an object that the twin lacks; 0 of all others
};

/// Nats that values bring, and what their scatter over places takes off.
struct EvidenceShare {
  double nats = 0, overdispersion = 1;
  double scattered() const { return nats / overdispersion; }
};

/// Several hypotheses, fitted together.
struct JointFit {
  std::vector<std::vector<double>> scaled_values;   ///< by hypothesis, of its coordinates
  std::vector<std::vector<double>> standard_error;  ///< of the values (not scaled), by location
  std::vector<EvidenceShare> worth;                 ///< of each beside the others; nothing without number
  SessionLatents nuisance;
};

constexpr int kSettling = 3;  ///< steps of the latents where one of several starts or places is judged

/// Indices of all poses of the session.
std::vector<int> everyPose(const ModelState& state);

struct Screened {
  Hypothesis hypothesis;
  double screened_nats = 0;                 ///< nats with little or nothing refitted, inflation taken off
  std::vector<std::vector<double>> starts;  ///< of a fit
};

/// Fits hypotheses against a state.
class HypothesisFitter {
 public:
  HypothesisFitter(ExpectedEchoes& source, const ChannelLikelihood& model, int folds);

  ModelState state(const std::vector<NamedParameters>& mechanisms, const SessionLatents* start);
  /// The same mechanisms with latents that are better than its own, looked for from latents that a fit has found.
  std::optional<ModelState> improved(const ModelState& null, const SessionLatents& latents);
  /// Maximum likelihood of the coordinates from the best of `starts`, the nuisance refitted along from the null's.
  /// least_nats: of a gain that matters; a climb that will not get there is given up. known: a fit of the same from
  /// whose latents it starts instead; what climbs to its top again is not searched.
  HypothesisFit fit(const ModelState& null, const Hypothesis& hypothesis,
                    const std::vector<std::vector<double>>& starts, double least_nats = 0,
                    const HypothesisFit* known = nullptr);
  /// Maximum likelihood of several hypotheses at once over `base`, which holds none of them.
  JointFit refit(const std::vector<NamedParameters>& base, const SessionLatents& nuisance,
                 const std::vector<Hypothesis>& parts, const std::vector<std::vector<double>>& start);
  /// Fold of a location.
  int fold(int location) const { return location % folds_; }
  int folds() const { return folds_; }
  /// Shortens the step to each fold's values until they are no worse than the fit's on the places that the fold is
  /// fitted to: where the likelihood is rough, scores of one place lead far away.
  void settleFolds(const ModelState& null, HypothesisFit& fit);
  /// Sets a fit's gains to those over this null, which may have become better since.
  void gainOver(const ModelState& null, HypothesisFit& fit) const;
  /// True of nats far beyond what clean sessions bring, whatever their scatter over places.
  bool isPlain(double nats) const;
  /// Sets false_alarm_rate and plain for a family of that many hypotheses.
  void judge(HypothesisFit& fit, std::size_t family) const;
  /// Of a gain in nats, inflation taken off, by that many numbers (coordinates, and what was searched for): chance that
  /// one of a family comes by it.
  double falseAlarmRate(double gain, const Hypothesis& hypothesis, std::size_t numbers, std::size_t family) const;

 private:
  struct Optimum {
    std::vector<double> scaled_values;
    ModelState state;
    Scores scores;  ///< at the last derivative
  };
  /// What the numbers from `first` on, which rise from nothing or turn the view, bring beside the others, without the
  /// place that gains most. Their square laws make what the errors at the fit say of that far too small.
  EvidenceShare worthOfPresence(const std::vector<NamedParameters>& base, const std::vector<Hypothesis>& parts,
                                const Optimum& o, const ProfiledScores& e, Eigen::Index first, Eigen::Index numbers);
  Eigen::MatrixXd robustCovariance(const ProfiledScores& effective) const;
  /// What values are worth, far from nothing as they are by their errors.
  EvidenceShare evidenceShareOf(const Hypothesis& hypothesis, const Eigen::VectorXd& scaled_values,
                                const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& robust) const;
  /// null: what a geometry has to be well above at more than one place before it is searched without slopes; null
  /// pointer: it is. least_nats, known: as of fit().
  Optimum maximise(const std::vector<NamedParameters>& base, const SessionLatents& nuisance,
                   const std::vector<Hypothesis>& parts, const std::vector<std::vector<double>>& starts, int steps,
                   const ModelState* null, double least_nats, const HypothesisFit* known);
  std::vector<double> gainByLocation(const ModelState& null, const ModelState& state) const;
  /// Beyond the null, without the place that gains most.
  double broadGain(const ModelState& null, const ModelState& state) const;

  ExpectedEchoes& source_;
  const ChannelLikelihood& model_;
  int folds_;
};

}  // namespace mmradartwin::diagnosis::fit
