#pragma once

#include <Eigen/Core>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::receiver {

/// Tone that belongs to the radar and not to the room: it is the same at every pose. At the only pose it is one that is
/// no array response.
struct BodyFixedTone {
  double range_m = 0, range_error_m = 0;  ///< range and its standard error
  Eigen::VectorXcd channels;              ///< [M] amplitude over full scale, phase at the window's centre
  double gain = 0;                        ///< nats over no tone; at one pose, over an echo from one direction
  double false_alarm_rate = 1;
  double array_share = 1;  ///< share of its power that the best single direction explains
  /// Nats by which the tone rather lies at negative ranges, where nothing can be: then samples are conjugated. 0 where
  /// negative ranges were not looked at.
  double behind = 0;
};

/// Looks for a tone in the first range bins, by likelihood. With several poses, complex t-distributed scatter of each
/// bin about a common vector stands against scatter about zero: echoes have another phase at every pose and do not add
/// up. With one pose, any vector over channels stands against an array response. `behind`: negative ranges are tried,
/// too.
BodyFixedTone findBodyFixedTone(const ChannelData& data, bool behind = false);
/// True where the tone is beyond doubt.
bool isUnambiguous(const BodyFixedTone& tone);
/// Takes the tone out of all poses.
void subtractTone(const BodyFixedTone& tone, ChannelData& data);

}  // namespace mmradartwin::diagnosis::receiver
