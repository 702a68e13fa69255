#pragma once

#include <Eigen/Core>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::receiver {

/// Tone of the radar itself: the same at every pose, whatever the room. With one pose, a tone that is no array
/// response.
struct BodyFixedTone {
  double range_m = 0, range_error_m = 0;  ///< range and its standard error
  Eigen::VectorXcd channels;              ///< [M] amplitude over full scale, with the phase at the window's centre
  double gain = 0;                        ///< nats over no tone; with one pose, over an echo from one direction
  double false_alarm_rate = 1;
  double array_share = 1;  ///< share of its power that the best single direction explains
  /// Nats by which negative ranges fit better, where nothing can be: samples are then conjugated. 0 where negative
  /// ranges were not tried.
  double behind = 0;
};

/// Searches for a tone in the first range bins by likelihood. With several poses, complex t-distributed scatter of each
/// bin about a common vector is compared with scatter about zero: echoes have another phase at every pose and do not
/// add up. With one pose, a free vector over channels is compared with an array response. behind: negative ranges are
/// tried, too.
BodyFixedTone findBodyFixedTone(const ChannelData& data, bool behind = false);
/// True where the evidence for the tone is beyond doubt.
bool isUnambiguous(const BodyFixedTone& tone);
/// Subtracts the tone from all poses.
void subtractTone(const BodyFixedTone& tone, ChannelData& data);

}  // namespace mmradartwin::diagnosis::receiver
