#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::rounds {

/// Judges the fits of one round, all supported by the likelihood, by the gain of their maps.
class MapEvidence {
 public:
  /// Keeps references. before: state that the round's fits are compared with.
  MapEvidence(DiagnosisContext& context, const ModelState& before) : context_(context), before_(before) {}

  /// Reason why a fit is no finding, "" where it is one. gain: on held-out places. Fits are passed best first: a fit
  /// that explains the same as a better, rejected one is rejected too.
  std::string rejection(const HypothesisFit& fit, const FindingGain& gain);
  /// Adds a fit that was rejected for another reason than the maps.
  void addRejected(const HypothesisFit& fit);

 private:
  /// Gain of a rejected fit.
  struct Rejected {
    Eigen::VectorXd nats_by_pose;
    bool by_maps;  ///< else by the errors of the session itself
  };
  bool hasEnoughEvidence(const HypothesisFit& fit, bool likelier, bool maps_gain_surely);
  bool explainsTheSame(const HypothesisFit& fit, const Eigen::VectorXd& nats_by_pose) const;

  DiagnosisContext& context_;
  const ModelState& before_;
  std::vector<Rejected> rejected_;
};

}  // namespace mmradartwin::diagnosis::rounds
