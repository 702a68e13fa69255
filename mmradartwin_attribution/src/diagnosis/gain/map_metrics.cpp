#include "diagnosis/gain/map_metrics.h"

#include <algorithm>
#include <map>
#include <string>

#include "diagnosis/numbers/location_bootstrap.h"
#include "mmradartwin_attribution/ledger.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::gain {
namespace {

/// Of one set of twins: each pose's counts and sums, by location.
using FieldsByLocation = std::vector<std::vector<FieldMetrics>>;

std::vector<GainMetric*> metricsOf(FindingGain& g) {
  std::vector<GainMetric*> all = {&g.recall, &g.q1, &g.q2, &g.q3_median_db};
  for (GainMetric& m : g.recall_band) all.push_back(&m);
  for (GainMetric& m : g.classes) all.push_back(&m);
  return all;
}

/// In the order of metricsOf(); each location `times` times.
std::vector<double> valuesOf(const FieldsByLocation& fields, const std::vector<int>& times) {
  Ledger ledger;
  for (std::size_t l = 0; l < fields.size(); ++l) {
    for (int n = 0; n < times[l]; ++n) {
      for (const FieldMetrics& pose : fields[l]) ledger.add(pose);
    }
  }
  const LedgerSummary s = ledger.summary();
  std::vector<double> values = {s.recall, s.q1_energy, s.q2_energy, s.q3_median_db};
  values.insert(values.end(), s.recall_band.begin(), s.recall_band.end());
  values.insert(values.end(), s.class_count.begin(), s.class_count.end());
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
  const auto fields = [&](const std::vector<std::vector<NamedParameters>>& folds) {
    std::vector<Twin> twins;
    for (const auto& mechanisms : folds) twins.push_back(twin.changed(mechanisms));
    std::vector<SimulatedBranch> branches;
    for (const Twin& t : twins) branches.push_back(simulatedByTwin(t));
    const SimulatedBranch simulated = [&](const Pose& pose) {
      return branches[static_cast<std::size_t>(fold_of(by_name.at(pose.name)->location)) % branches.size()](pose);
    };
    FieldsByLocation all(data.locations.size());
    for (const PoseResult& pose : evaluate(used, simulated, twin.scene(), twin.rays(), options, measured).poses) {
      if (!pose.used) continue;
      all[static_cast<std::size_t>(by_name.at(pose.pose.name)->location)].push_back(pose.attribution.central);
    }
    return all;
  };
  const FieldsByLocation b = fields({before}), a = fields(after);
  const std::vector<int> once(data.locations.size(), 1);
  const std::vector<double> from = valuesOf(b, once), to = valuesOf(a, once);
  const auto intervals = intervalsOverLocations(data.locations.size(), [&](const std::vector<int>& times) {
    std::vector<double> difference = valuesOf(a, times);
    const std::vector<double> without = valuesOf(b, times);
    for (std::size_t k = 0; k < difference.size(); ++k) difference[k] -= without[k];
    return difference;
  });
  const std::vector<GainMetric*> metrics = metricsOf(gain);
  for (std::size_t k = 0; k < metrics.size(); ++k) *metrics[k] = {from[k], to[k], intervals[k]};
}

}  // namespace mmradartwin::diagnosis::gain
