#pragma once

#include <Eigen/Core>

#include "channel_data.h"

namespace mmradartwin {

/// A tone that is the same at every pose: it belongs to the radar, not to the room.
struct BodyFixedTone {
  double range_m = 0, range_error_m = 0;  ///< and its standard error
  Eigen::VectorXcd channels;              ///< [M] amplitude over full scale, phase at the window's centre
  double gain = 0;                        ///< nats over no such tone
  double false_alarm_rate = 1;
};

/// Looks for one in the first bins, by likelihood: complex t-distributed scatter of each bin about a common vector
/// against about zero. Echoes have another phase at every pose and do not add up.
BodyFixedTone findBodyFixedTone(const ChannelData& data);
/// Takes it out of all poses.
void subtractTone(const BodyFixedTone& tone, ChannelData& data);

}  // namespace mmradartwin
