#pragma once

#include <Eigen/Core>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::receiver {

/// A tone that belongs to the radar, not to the room: the same at every pose, or at the only one no array response.
struct BodyFixedTone {
  double range_m = 0, range_error_m = 0;  ///< and its standard error
  Eigen::VectorXcd channels;              ///< [M] amplitude over full scale, phase at the window's centre
  double gain = 0;                        ///< nats over no such tone; of one pose over an echo from one direction
  double false_alarm_rate = 1;
  double array_share = 1;  ///< of its power, that the best single direction explains
  /// Nats by which the tone lies rather at negative ranges, where nothing can: the samples are conjugated. Only where
  /// these were looked at.
  double behind = 0;
};

/// Looks for one in the first bins, by likelihood. With several poses: complex t-distributed scatter of each bin about
/// a common vector against about zero; echoes have another phase at every pose and do not add up. With one pose: any
/// vector over channels against an array response. `behind`: at negative ranges too.
BodyFixedTone findBodyFixedTone(const ChannelData& data, bool behind = false);
/// So likely that it is claimed.
bool isPlain(const BodyFixedTone& tone);
/// Takes it out of all poses.
void subtractTone(const BodyFixedTone& tone, ChannelData& data);

}  // namespace mmradartwin::diagnosis::receiver
