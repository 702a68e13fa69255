#include "diagnosis/gain/map_metrics.h"

#include <algorithm>
#include <map>
#include <string>

#include "diagnosis/numbers/location_bootstrap.h"
#include "mmradartwin_attribution/ledger.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::gain {
namespace {

/// Counts and sums of each pose, by location.
using FieldsByLocation = std::vector<std::vector<FieldMetrics>>;

/// Metrics that are filled here, in the order of valuesOf().
std::vector<GainMetric*> metricsOf(FindingGain& gain) {
  std::vector<GainMetric*> metrics = {&gain.recall, &gain.q1, &gain.q2, &gain.q3_median_db};
  for (GainMetric& metric : gain.recall_band) metrics.push_back(&metric);
  for (GainMetric& metric : gain.classes) metrics.push_back(&metric);
  return metrics;
}

/// Values of the metrics, in the order of metricsOf(), each location counted `times` times.
std::vector<double> valuesOf(const FieldsByLocation& fields, const std::vector<int>& times) {
  Ledger ledger;
  for (std::size_t l = 0; l < fields.size(); ++l) {
    for (int n = 0; n < times[l]; ++n) {
      for (const FieldMetrics& pose : fields[l]) ledger.add(pose);
    }
  }
  const LedgerSummary summary = ledger.summary();
  std::vector<double> values = {summary.recall, summary.q1_energy, summary.q2_energy, summary.q3_median_db};
  values.insert(values.end(), summary.recall_band.begin(), summary.recall_band.end());
  values.insert(values.end(), summary.class_count.begin(), summary.class_count.end());
  return values;
}

}  // namespace

void addMapMetrics(const Recording& recording, const Twin& twin, const ChannelData& data,
                   const std::vector<NamedParameters>& before, const std::vector<std::vector<NamedParameters>>& after,
                   const std::function<int(int)>& fold_of, const EvaluationOptions& options, FindingGain& gain) {
  const SignalChain chain(data.radar);
  std::map<std::string, const PoseChannels*> by_name;
  Recording used = recording;
  used.poses.clear();
  for (const PoseChannels& p : data.poses) {
    if (p.uncorrected_average.x.size() == 0) continue;
    by_name[p.pose.name] = &p;
    used.poses.push_back(p.pose);
  }
  const MeasuredBranch measured = [&](const Pose& pose) {
    return chain.map(by_name.at(pose.name)->uncorrected_average);
  };
  const auto fieldsOf = [&](const std::vector<std::vector<NamedParameters>>& folds) {
    std::vector<Twin> twins;
    for (const auto& mechanisms : folds) twins.push_back(twin.changed(mechanisms));
    std::vector<SimulatedBranch> branches;
    for (const Twin& of_fold : twins) branches.push_back(simulatedByTwin(of_fold));
    const SimulatedBranch simulated = [&](const Pose& pose) {
      return branches[static_cast<std::size_t>(fold_of(by_name.at(pose.name)->location)) % branches.size()](pose);
    };
    FieldsByLocation fields(data.locations.size());
    for (const PoseResult& pose : evaluate(used, simulated, twin.scene(), twin.rays(), options, measured).poses) {
      if (!pose.used) continue;
      fields[static_cast<std::size_t>(by_name.at(pose.pose.name)->location)].push_back(pose.attribution.central);
    }
    return fields;
  };
  const FieldsByLocation fields_before = fieldsOf({before}), fields_after = fieldsOf(after);
  const std::vector<int> once(data.locations.size(), 1);
  const std::vector<double> values_before = valuesOf(fields_before, once), values_after = valuesOf(fields_after, once);
  const auto intervals = intervalsOverLocations(data.locations.size(), [&](const std::vector<int>& times) {
    std::vector<double> difference = valuesOf(fields_after, times);
    const std::vector<double> without = valuesOf(fields_before, times);
    for (std::size_t k = 0; k < difference.size(); ++k) difference[k] -= without[k];
    return difference;
  });
  const std::vector<GainMetric*> metrics = metricsOf(gain);
  for (std::size_t k = 0; k < metrics.size(); ++k) *metrics[k] = {values_before[k], values_after[k], intervals[k]};
}

}  // namespace mmradartwin::diagnosis::gain
