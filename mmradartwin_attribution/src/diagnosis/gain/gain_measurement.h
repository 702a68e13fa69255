#pragma once

#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_options.h"
#include "mmradartwin_attribution/evaluation.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::gain {

/// Measures how much better a twin describes the session with a finding than without it. Locations are held out
/// wherever something was fitted.
class GainMeasurement {
 public:
  /// Keeps a reference.
  explicit GainMeasurement(DiagnosisContext& context) : context_(context) {}

  /// Gain of a fit over `before` in explained power and log-likelihood. Each fold of locations is expected with the
  /// values that the other folds gave.
  void ofFit(const ModelState& before, HypothesisFit& fit, Finding& finding);
  /// Cell powers of every pose with a fit added to `before`, each with the values of the fold that did not see it.
  std::vector<CellPowers> heldOutPowers(const ModelState& before, HypothesisFit& fit);
  /// Gain in explained power of one list of mechanisms and its data over another, with nothing fitted. Does nothing
  /// with fewer than two locations. The expected echoes keep `before` as their baseline.
  void ofChange(const ChannelData& before_data, const std::vector<NamedParameters>& before,
                const ChannelData& after_data, const std::vector<NamedParameters>& after, Finding& finding);
  /// Gain of a fit over `before` in the paper's metrics, on maps of the recording's uncorrected averages.
  void addMetrics(const std::vector<NamedParameters>& before, const HypothesisFit& fit, FindingGain& gain) const;
  /// Gain in the paper's metrics of one list of mechanisms over another, with nothing fitted.
  void addMetrics(const std::vector<NamedParameters>& before, const std::vector<NamedParameters>& after,
                  FindingGain& gain) const;

 private:
  /// Echoes of every pose with the fit's values of the fold that did not see the pose. actor_range_m: as for
  /// ExpectedEchoes.
  std::vector<PoseEchoes> heldOutEchoes(const std::vector<NamedParameters>& before, const HypothesisFit& fit,
                                        const std::vector<double>& actor_range_m);
  EvaluationOptions evaluationOptions() const;

  DiagnosisContext& context_;
};

}  // namespace mmradartwin::diagnosis::gain
