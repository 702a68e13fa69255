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

/// State of the model: mechanisms, their echoes, and latents fitted to the session.
struct ModelState {
  std::vector<NamedParameters> mechanisms;
  std::vector<double> actor_range_m;  ///< ranges about which the echoes were collected
  std::vector<PoseEchoes> echoes;
  SessionLatents latents;
  double log_likelihood = 0;
  std::vector<double> by_pose;
  // Derivatives at latents; only HypothesisFitter::state() fills them.
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
  bool overwhelming = false;
  std::size_t numbers() const;  ///< how many were fitted or searched for, at least one
  double ranking() const;       ///< gain, or the ranked share of it, less a price per number
  double moved_m() const;       ///< how far it moves an actor, or all of them; 0 where it moves none
  bool isFarAway() const;       ///< moves much farther than an actor's place is wrong by, and gains by it
  double size_m() const;        ///< of an object that the twin lacks; 0 for all others
};

/// Nats that values bring, and the overdispersion by which they are divided.
struct EvidenceShare {
  double nats = 0, overdispersion = 1;
  double scattered() const { return nats / overdispersion; }
};

/// Fit of several hypotheses together.
struct JointFit {
  std::vector<std::vector<double>> scaled_values;   ///< [hypotheses][coordinates]
  std::vector<std::vector<double>> standard_error;  ///< [hypotheses][coordinates] of the values (not scaled)
  std::vector<EvidenceShare> evidence;              ///< [hypotheses] beside the others; nothing without coordinates
  SessionLatents latents;
};

constexpr int kLatentSteps = 3;  ///< Fisher steps of the latents before one of several starts or places is judged

/// Indices of all poses of the session.
std::vector<int> everyPose(const ModelState& state);

/// Hypothesis that was looked at without a fit.
struct Screened {
  Hypothesis hypothesis;
  double screened_nats = 0;                 ///< promised nats over the overdispersion, little or nothing refitted
  std::vector<std::vector<double>> starts;  ///< scaled coordinates to start a fit from
};

struct Optimum;

/// Fits hypotheses by maximum likelihood, over a state of the model that has none of them (the *null*).
class HypothesisFitter {
 public:
  HypothesisFitter(ExpectedEchoes& source, const ChannelLikelihood& model, int folds,
                   StatedBounds stated = StatedBounds());

  /// State of these mechanisms with all latents fitted, from `start` where it is given.
  ModelState state(const std::vector<NamedParameters>& mechanisms, const SessionLatents* start);
  /// State of the null's mechanisms with better latents, looked for from latents that a fit has found; nothing where
  /// there are none.
  std::optional<ModelState> improved(const ModelState& null, const SessionLatents& latents);
  /// Maximum likelihood of the coordinates from the best of `starts`, latents refitted along from the null's.
  /// least_nats: gain that matters; a climb that will not reach it is given up. known: a fit of the same hypothesis,
  /// from whose latents the climb starts instead; a climb that ends at its top again is not searched further.
  HypothesisFit fit(const ModelState& null, const Hypothesis& hypothesis,
                    const std::vector<std::vector<double>>& starts, double least_nats = 0,
                    const HypothesisFit* known = nullptr);
  /// Maximum likelihood of several hypotheses at once over `base`, which holds none of them.
  JointFit refit(const std::vector<NamedParameters>& base, const SessionLatents& latents,
                 const std::vector<Hypothesis>& parts, const std::vector<std::vector<double>>& start);
  /// Fold of a location.
  int fold(int location) const { return location % folds_; }
  int folds() const { return folds_; }
  /// Shortens the step to each fold's values until they are no worse than the fit's on the places that the fold is
  /// fitted to. Where the likelihood is rough, scores of one place lead far away.
  void shortenFoldSteps(const ModelState& null, HypothesisFit& fit);
  /// Sets a fit's gains to those over this null, which may have become better since.
  void gainOver(const ModelState& null, HypothesisFit& fit) const;
  /// True for nats far beyond what clean sessions bring, whatever their scatter over places.
  bool isOverwhelming(double nats) const;
  /// Sets false_alarm_rate and plain of a fit, one of a family of hypotheses.
  void judge(HypothesisFit& fit, std::size_t family) const;
  /// Probability that one of a family of hypotheses gains so many nats (overdispersion divided out) by chance. numbers:
  /// coordinates, and numbers that were searched for.
  double falseAlarmRate(double gain, const Hypothesis& hypothesis, std::size_t numbers, std::size_t family) const;

 private:
  /// Nats that the numbers from `first` on bring beside the others, without the place that gains most. For numbers that
  /// rise from nothing or turn the view the errors at the fit say far too little: the likelihood follows a square law.
  EvidenceShare evidenceOfPresence(const std::vector<NamedParameters>& base, const std::vector<Hypothesis>& parts,
                                   const Optimum& o, const ProfiledScores& e, Eigen::Index first, Eigen::Index numbers);
  Eigen::MatrixXd robustCovariance(const ProfiledScores& effective) const;
  /// Nats by which values lie off nothing, by their errors.
  EvidenceShare evidenceShareOf(const Hypothesis& hypothesis, const Eigen::VectorXd& scaled_values,
                                const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& robust) const;

  ExpectedEchoes& source_;
  const ChannelLikelihood& model_;
  int folds_;
  StatedBounds stated_;
};

}  // namespace mmradartwin::diagnosis::fit
