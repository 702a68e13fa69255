#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "diagnosis/catalogue/stated_bounds.h"
#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/likelihood/profiled_scores.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::fit {

/// Nats that values bring, and the overdispersion by which they are divided.
struct EvidenceShare {
  double nats = 0, overdispersion = 1;
  double scattered() const { return nats / overdispersion; }
};

/// Fit of several hypotheses together.
struct JointFit {
  std::vector<std::vector<double>> scaled_values;   ///< [hypotheses][coordinates]
  std::vector<std::vector<double>> standard_error;  ///< [hypotheses][coordinates] of the values (not scaled)
  std::vector<EvidenceShare> worth;                 ///< [hypotheses] beside the others; nothing without coordinates
  SessionLatents nuisance;
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
  JointFit refit(const std::vector<NamedParameters>& base, const SessionLatents& nuisance,
                 const std::vector<Hypothesis>& parts, const std::vector<std::vector<double>>& start);
  /// Fold of a location.
  int fold(int location) const { return location % folds_; }
  int folds() const { return folds_; }
  /// Shortens the step to each fold's values until they are no worse than the fit's on the places that the fold is
  /// fitted to. Where the likelihood is rough, scores of one place lead far away.
  void settleFolds(const ModelState& null, HypothesisFit& fit);
  /// Sets a fit's gains to those over this null, which may have become better since.
  void gainOver(const ModelState& null, HypothesisFit& fit) const;
  /// True for nats far beyond what clean sessions bring, whatever their scatter over places.
  bool isPlain(double nats) const;
  /// Sets false_alarm_rate and plain of a fit, one of a family of hypotheses.
  void judge(HypothesisFit& fit, std::size_t family) const;
  /// Probability that one of a family of hypotheses gains so many nats (overdispersion divided out) by chance. numbers:
  /// coordinates, and numbers that were searched for.
  double falseAlarmRate(double gain, const Hypothesis& hypothesis, std::size_t numbers, std::size_t family) const;

 private:
  /// Nats that the numbers from `first` on bring beside the others, without the place that gains most. For numbers that
  /// rise from nothing or turn the view the errors at the fit say far too little: the likelihood follows a square law.
  EvidenceShare worthOfPresence(const std::vector<NamedParameters>& base, const std::vector<Hypothesis>& parts,
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
