#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/catalogue/stated_bounds.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/likelihood/profiled_scores.h"
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

/// Nats that fitted values gain, and the overdispersion by which they are divided.
struct EvidenceShare {
  double nats = 0, overdispersion = 1;
  double scattered() const { return nats / overdispersion; }
};

/// Joint fit of several hypotheses.
struct JointFit {
  std::vector<std::vector<double>> scaled_values;   ///< [hypotheses][coordinates]
  std::vector<std::vector<double>> standard_error;  ///< [hypotheses][coordinates] of the values in their units
  std::vector<EvidenceShare> evidence;              ///< [hypotheses] given the others; zero without coordinates
  SessionLatents latents;
};

constexpr int kLatentSteps = 3;  ///< Fisher steps of the latents before starts or places are compared

/// Indices of all poses of the session.
std::vector<int> everyPose(const ModelState& state);

/// Hypothesis that was judged without a fit.
struct Screened {
  Hypothesis hypothesis;
  double screened_nats = 0;  ///< screened gain: nats over the overdispersion, with few or no latents refitted
  std::vector<std::vector<double>> starts;  ///< [starts][coordinates] scaled values from which a fit starts
};

struct Optimum;

/// Fits hypotheses by maximum likelihood over a state of the model without them (the *null*).
class HypothesisFitter {
 public:
  HypothesisFitter(ExpectedEchoes& source, const ChannelLikelihood& model, int folds,
                   StatedBounds stated = StatedBounds());

  /// State of these mechanisms with all latents fitted. The fit starts from `start`, or from the data where that is
  /// null.
  ModelState state(const std::vector<NamedParameters>& mechanisms, const SessionLatents* start);
  /// State of the null's mechanisms with a higher likelihood, searched from the latents of another fit. Nothing where
  /// there is none.
  std::optional<ModelState> improved(const ModelState& null, const SessionLatents& latents);
  /// Maximum likelihood of the coordinates from the best of `starts`, with latents refitted from the null's.
  /// least_nats: gain below which the fit does not matter; a climb that will not reach it stops. known: earlier fit of
  /// the same hypothesis; the climb starts from its latents and skips the search where it ends at the same optimum.
  HypothesisFit fit(const ModelState& null, const Hypothesis& hypothesis,
                    const std::vector<std::vector<double>>& starts, double least_nats = 0,
                    const HypothesisFit* known = nullptr);
  /// Joint maximum likelihood of several hypotheses over `base`, which holds none of them.
  JointFit refit(const std::vector<NamedParameters>& base, const SessionLatents& latents,
                 const std::vector<Hypothesis>& parts, const std::vector<std::vector<double>>& start);
  /// Fold of a location, by its index.
  int fold(int location) const { return location % folds_; }
  int folds() const { return folds_; }
  /// Shortens the step to each fold's values until the fold's own places lose nothing against the fit. The scores of
  /// one place lead far away where the likelihood is rough.
  void shortenFoldSteps(const ModelState& null, HypothesisFit& fit);
  /// Sets a fit's gains to those over this null, which may have improved since the fit.
  void gainOver(const ModelState& null, HypothesisFit& fit) const;
  /// True for nats far above those of clean sessions. The scatter over places is then ignored.
  bool isOverwhelming(double nats) const;
  /// Sets false_alarm_rate and overwhelming of a fit that is one of a family of hypotheses.
  void judge(HypothesisFit& fit, std::size_t family) const;
  /// Probability that one of a family of hypotheses gains so many nats by chance. gain: nats over the overdispersion.
  /// numbers: coordinates and numbers that were searched for.
  double falseAlarmRate(double gain, const Hypothesis& hypothesis, std::size_t numbers, std::size_t family) const;

 private:
  /// Nats that the coordinates from `first` on gain given the others, without the place that gains most. Measured by
  /// the likelihood without them, since one-sided numbers and turns of the view are far from a quadratic.
  EvidenceShare evidenceOfPresence(const std::vector<NamedParameters>& base, const std::vector<Hypothesis>& parts,
                                   const Optimum& o, const ProfiledScores& e, Eigen::Index first, Eigen::Index numbers);
  Eigen::MatrixXd robustCovariance(const ProfiledScores& effective) const;
  /// Nats by which values differ from zero, by their errors.
  EvidenceShare evidenceShareOf(const Hypothesis& hypothesis, const Eigen::VectorXd& scaled_values,
                                const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& robust) const;

  ExpectedEchoes& source_;
  const ChannelLikelihood& model_;
  int folds_;
  StatedBounds stated_;
};

}  // namespace mmradartwin::diagnosis::fit
