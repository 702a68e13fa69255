#pragma once

#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_options.h"
#include "mmradartwin_attribution/evaluation.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::gain {

/// What findings gain, on held-out places wherever something was fitted.
class GainMeasurement {
 public:
  /// Keeps references.
  GainMeasurement(const Recording& recording, const Twin& twin, const ChannelData& data, ExpectedEchoes& source,
                  const ChannelLikelihood& model, HypothesisFitter& fitter, const DiagnosisOptions& options)
      : recording_(recording),
        twin_(twin),
        data_(data),
        source_(source),
        model_(model),
        fitter_(fitter),
        options_(options) {}

  /// In explained power and likelihood: of a fit over `before`, each fold of places by the values of the others.
  void ofFit(const ModelState& before, HypothesisFit& fit, Finding& f);
  /// In explained power: of data and mechanisms against others, as they are. Nothing with fewer than two locations.
  /// Leaves the source settled on `before`.
  void ofChange(const ChannelData& before_data, const std::vector<NamedParameters>& before,
                const ChannelData& after_data, const std::vector<NamedParameters>& after, Finding& f);
  /// In the paper's metrics: of a fit over `before`, mechanisms as the recording has them.
  void addMetrics(const std::vector<NamedParameters>& before, const HypothesisFit& fit, FindingGain& gain) const;
  /// The same of two lists of mechanisms as they are.
  void addMetrics(const std::vector<NamedParameters>& before, const std::vector<NamedParameters>& after,
                  FindingGain& gain) const;

 private:
  std::vector<PoseEchoes> heldOutEchoes(const std::vector<NamedParameters>& before, const HypothesisFit& fit,
                                        const std::vector<double>& actor_range_m);
  EvaluationOptions evaluationOptions() const;

  const Recording& recording_;
  const Twin& twin_;
  const ChannelData& data_;
  ExpectedEchoes& source_;
  const ChannelLikelihood& model_;
  HypothesisFitter& fitter_;
  const DiagnosisOptions& options_;
};

}  // namespace mmradartwin::diagnosis::gain
