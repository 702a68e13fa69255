#pragma once

#include <map>
#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/likelihood/echo_field.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::gain {

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

/// A finding's explained power before and after, held out where `after` is, the maps for its figure, and the cells that
/// carry it where it has no place in the maps yet.
void compareMaps(const ChannelData& data, const std::vector<CellPowers>& before, const std::vector<CellPowers>& after,
                 Finding& f);

/// Mean difference per pose with its 95 % interval by bootstrap over locations.
GainMetric likelihoodGain(const ChannelData& data, const std::vector<double>& before, const std::vector<double>& after);

/// Sets a finding's gain in nats per pose, over nothing, from those by pose where there are any, else from its
/// evidence; nothing with fewer than two locations.
void addGainInNats(const ChannelData& data, const std::map<std::string, double>& by_pose, Finding& f);

}  // namespace mmradartwin::diagnosis::gain
