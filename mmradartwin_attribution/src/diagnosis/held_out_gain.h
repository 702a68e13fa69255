#pragma once

#include <array>
#include <functional>
#include <vector>

#include "channel_data.h"
#include "echo_field.h"
#include "mmradartwin_attribution/evaluation.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// Measured and expected power in the cells of a map beyond 0.16 m and within 60 deg (DESIGN section 5).
struct CellPowers {
  std::vector<double> measured, expected;
};
std::vector<CellPowers> cellPowers(const ChannelData& data, const std::vector<PoseEchoes>& echoes);

/// explained_power = 1 - sum (sqrt(P_meas) - sqrt(g P_twin))^2 / sum P_meas over all poses, with the one gain of the
/// session sqrt(g) = sum sqrt(P_meas P_twin)/sum P_twin.
double explainedPower(const std::vector<CellPowers>& poses);
/// Before and after, and the difference's 95 % interval by bootstrap over locations.
GainMetric explainedPowerGain(const ChannelData& data, const std::vector<CellPowers>& before,
                              const std::vector<CellPowers>& after);

/// A finding's explained power before and after, held out where `after` is, and the maps for its figure.
void compareMaps(const ChannelData& data, const std::vector<CellPowers>& before, const std::vector<CellPowers>& after,
                 Finding& f);

/// Mean difference per pose with its 95 % interval by bootstrap over locations.
GainMetric likelihoodGain(const ChannelData& data, const std::vector<double>& before, const std::vector<double>& after);

/// The paper's metrics of the poses in `data` (recall by band, Q1, Q2, Q3, C1 to C5) before and after: mechanisms by
/// fold, or one list for all. `fold_of` a location.
void addMapMetrics(const Recording& recording, const Twin& twin, const ChannelData& data,
                   const std::vector<std::vector<NamedParameters>>& before,
                   const std::vector<std::vector<NamedParameters>>& after, const std::function<int(int)>& fold_of,
                   const EvaluationOptions& options, FindingGain& gain);

}  // namespace mmradartwin
