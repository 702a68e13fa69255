#include "diagnosis/gain/gain_measurement.h"

#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/gain/map_metrics.h"

namespace mmradartwin::diagnosis::gain {

std::vector<PoseEchoes> GainMeasurement::heldOutEchoes(const std::vector<NamedParameters>& before,
                                                       const HypothesisFit& fit,
                                                       const std::vector<double>& actor_range_m) {
  std::vector<PoseEchoes> echoes(data_.poses.size());
  for (int k = 0; k < fitter_.folds(); ++k) {
    std::vector<int> poses;
    for (std::size_t i = 0; i < data_.poses.size(); ++i) {
      if (fitter_.fold(data_.poses[i].location) == k) poses.push_back(static_cast<int>(i));
    }
    if (poses.empty()) continue;
    std::vector<NamedParameters> mechanisms = before;
    replaceOrAppend(fit.hypothesis.at(fit.fold_scaled[static_cast<std::size_t>(k)]), mechanisms);
    std::vector<PoseEchoes> part = source_.echoes(mechanisms, poses, actor_range_m);
    for (std::size_t j = 0; j < poses.size(); ++j) echoes[static_cast<std::size_t>(poses[j])] = std::move(part[j]);
  }
  return echoes;
}

void GainMeasurement::ofFit(const ModelState& before, HypothesisFit& fit, Finding& finding) {
  fitter_.settleFolds(before, fit);
  measureHeldOutGain(data_, cellPowers(data_, source_.echoes(before.mechanisms)),
                     cellPowers(data_, heldOutEchoes(before.mechanisms, fit, {})), finding);
  std::vector<double> likelihood;
  model_.logLikelihood(heldOutEchoes(before.mechanisms, fit, fit.state.actor_range_m), fit.state.nuisance, &likelihood);
  source_.setBaseline(before.mechanisms);
  finding.gain->log_likelihood_per_pose = likelihoodGain(data_, before.by_pose, likelihood);
}

void GainMeasurement::ofChange(const ChannelData& before_data, const std::vector<NamedParameters>& before,
                               const ChannelData& after_data, const std::vector<NamedParameters>& after,
                               Finding& finding) {
  if (data_.locations.size() < 2) return;
  const std::vector<PoseEchoes> echoes_before = source_.echoes(before), echoes_after = source_.echoes(after);
  source_.setBaseline(before);
  measureHeldOutGain(data_, cellPowers(before_data, echoes_before), cellPowers(after_data, echoes_after), finding);
}

EvaluationOptions GainMeasurement::evaluationOptions() const {
  EvaluationOptions options;
  options.config = options_.config;
  options.jobs = options_.jobs;
  return options;
}

void GainMeasurement::addMetrics(const std::vector<NamedParameters>& before, const HypothesisFit& fit,
                                 FindingGain& gain) const {
  std::vector<std::vector<NamedParameters>> after;
  for (const std::vector<double>& scaled_values : fit.fold_scaled) {
    after.push_back(before);
    replaceOrAppend(fit.hypothesis.at(scaled_values), after.back());
  }
  addMapMetrics(
      recording_, twin_, data_, before, after, [&](int location) { return fitter_.fold(location); },
      evaluationOptions(), gain);
}

void GainMeasurement::addMetrics(const std::vector<NamedParameters>& before, const std::vector<NamedParameters>& after,
                                 FindingGain& gain) const {
  addMapMetrics(
      recording_, twin_, data_, before, {after}, [](int) { return 0; }, evaluationOptions(), gain);
}

}  // namespace mmradartwin::diagnosis::gain
