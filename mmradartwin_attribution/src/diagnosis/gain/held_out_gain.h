#pragma once

#include <map>
#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/echoes/echo_field.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::gain {

/// Linear power in the evaluated cells of one pose's map: beyond 0.16 m and within 60 deg of the boresight. Range is
/// the outer index, azimuth the inner one. Both lists have the same length.
struct CellPowers {
  std::vector<double> measured;  ///< |S|^2 of the pose's average
  std::vector<double> expected;  ///< its expectation under a twin, before the session's gain
};
/// Cell powers of all poses; echoes by pose, as data.poses.
std::vector<CellPowers> cellPowers(const ChannelData& data, const std::vector<PoseEchoes>& echoes);

/// Share of the measured power that a twin explains, 1 where the maps agree up to a gain:
/// 1 - sum (sqrt(P_meas) - sqrt(g P_twin))^2 / sum P_meas over the cells of all poses, with one gain for the session,
/// sqrt(g) = sum sqrt(P_meas P_twin)/sum P_twin.
double explainedPower(const std::vector<CellPowers>& poses);
/// The session's power gain g of explainedPower().
double powerGain(const std::vector<CellPowers>& poses);
/// Explained power before and after, and the 95 % interval of its difference by bootstrap over locations.
GainMetric explainedPowerGain(const ChannelData& data, const std::vector<CellPowers>& before,
                              const std::vector<CellPowers>& after);

/// Fills a finding's explained power before and after, the maps of its figure and, where its only place has none, the
/// cells that carry it. The gain is held out if `after` was expected by fits that did not see the pose.
void measureHeldOutGain(const ChannelData& data, const std::vector<CellPowers>& before,
                        const std::vector<CellPowers>& after, Finding& finding);

/// Mean log-likelihood per pose [nats] before and after, and the 95 % interval of the mean difference by bootstrap over
/// locations. before, after: by pose.
GainMetric likelihoodGain(const ChannelData& data, const std::vector<double>& before, const std::vector<double>& after);

/// Sets a finding's gain in nats per pose over a likelihood of 0: from `by_pose` (nats by the pose's name) or, where
/// that is empty, from the finding's evidence. Does nothing with fewer than two locations.
void addGainInNats(const ChannelData& data, const std::map<std::string, double>& by_pose, Finding& finding);

}  // namespace mmradartwin::diagnosis::gain
