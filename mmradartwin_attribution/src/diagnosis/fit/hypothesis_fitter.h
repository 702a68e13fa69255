#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "diagnosis/catalogue/stated_bounds.h"
#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/profiled_scores.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::fit {

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

struct Optimum;

/// Fits hypotheses by maximum likelihood over a state of the model without them (the *null*).
class HypothesisFitter {
 public:
  HypothesisFitter(ExpectedEchoes& source, const ChannelLikelihood& model, int folds,
                   StatedBounds stated = StatedBounds());

  void setStated(StatedBounds stated) { stated_ = stated; }
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
