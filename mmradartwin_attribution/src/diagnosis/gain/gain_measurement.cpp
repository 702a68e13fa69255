#include "diagnosis/gain/gain_measurement.h"

#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/gain/map_metrics.h"

namespace mmradartwin::diagnosis::gain {

std::vector<PoseEchoes> GainMeasurement::heldOutEchoes(const std::vector<NamedParameters>& before,
                                                       const HypothesisFit& fit,
                                                       const std::vector<double>& actor_range_m) {
  std::vector<PoseEchoes> echoes(context_.data.poses.size());
  for (int k = 0; k < context_.fitter.folds(); ++k) {
    std::vector<int> poses;
    for (std::size_t i = 0; i < context_.data.poses.size(); ++i) {
      if (context_.fitter.fold(context_.data.poses[i].location) == k) poses.push_back(static_cast<int>(i));
    }
    if (poses.empty()) continue;
    std::vector<NamedParameters> mechanisms = before;
    replaceOrAppend(fit.hypothesis.at(fit.fold_scaled[static_cast<std::size_t>(k)]), mechanisms);
    std::vector<PoseEchoes> part = context_.echoes.echoes(mechanisms, poses, actor_range_m);
    for (std::size_t j = 0; j < poses.size(); ++j) echoes[static_cast<std::size_t>(poses[j])] = std::move(part[j]);
  }
  return echoes;
}

void GainMeasurement::ofFit(const ModelState& before, HypothesisFit& fit, Finding& finding) {
  const std::vector<CellPowers> after = heldOutPowers(before, fit);
  measureHeldOutGain(context_.data, cellPowers(context_.data, context_.echoes.echoes(before.mechanisms)), after,
                     finding);
  std::vector<double> likelihood;
  context_.likelihood.logLikelihood(heldOutEchoes(before.mechanisms, fit, fit.state.actor_range_m), fit.state.latents,
                                    &likelihood);
  context_.echoes.setBaseline(before.mechanisms);
  finding.gain->log_likelihood_per_pose = likelihoodGain(context_.data, before.by_pose, likelihood);
}

std::vector<CellPowers> GainMeasurement::heldOutPowers(const ModelState& before, HypothesisFit& fit) {
  context_.fitter.shortenFoldSteps(before, fit);
  std::vector<CellPowers> powers = cellPowers(context_.data, heldOutEchoes(before.mechanisms, fit, {}));
  context_.echoes.setBaseline(before.mechanisms);
  return powers;
}

void GainMeasurement::ofChange(const ChannelData& before_data, const std::vector<NamedParameters>& before,
                               const ChannelData& after_data, const std::vector<NamedParameters>& after,
                               Finding& finding) {
  if (context_.data.locations.size() < 2) return;
  const std::vector<PoseEchoes> echoes_before = context_.echoes.echoes(before),
                                echoes_after = context_.echoes.echoes(after);
  context_.echoes.setBaseline(before);
  measureHeldOutGain(context_.data, cellPowers(before_data, echoes_before), cellPowers(after_data, echoes_after),
                     finding);
}

EvaluationOptions GainMeasurement::evaluationOptions() const {
  EvaluationOptions options;
  options.config = context_.options.config;
  options.jobs = context_.options.jobs;
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
      context_.recording, context_.twin, context_.data, before, after,
      [&](int location) { return context_.fitter.fold(location); }, evaluationOptions(), gain);
}

void GainMeasurement::addMetrics(const std::vector<NamedParameters>& before, const std::vector<NamedParameters>& after,
                                 FindingGain& gain) const {
  addMapMetrics(
      context_.recording, context_.twin, context_.data, before, {after}, [](int) { return 0; }, evaluationOptions(),
      gain);
}

}  // namespace mmradartwin::diagnosis::gain
