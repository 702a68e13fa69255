#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::receiver {

/// What channels have in common: nothing but their transmitter; receiver and transmitter; nothing.
enum class ChannelTie { kTransmitters, kReceivers, kFree };

/// What echoes say of the radar's channels without a scene: an echo from one direction is an array response, whatever
/// that direction is, and errors of channels are what all echoes have in common beside it.
struct ChannelErrors {
  /// [M] relative to channel 0. A slope over the array cannot be told from a turn of the radar: it is taken as none
  /// where receivers differ at all.
  Eigen::VectorXd phase_rad, gain_db;
  /// Standard errors; a phase's has the slope that errors of this size would have by chance.
  Eigen::VectorXd phase_error_rad, gain_error_db;
  ChannelTie tie = ChannelTie::kFree;
  double apart_rad = 0;        ///< largest difference of a receiver's phase between transmitters where nothing is tied
  double gain = 0;             ///< nats over no errors
  double held_out_gain = 0;    ///< of echoes at ranges (or places) that the fit did not see
  int echoes = 0, groups = 0;  ///< and groups of them, which the standard errors are from
};

/// Order of channels that fits the echoes best; order[i] is the true channel that stands in place i.
struct ChannelOrder {
  std::vector<int> order;
  double gain = 0;    ///< nats over the order as it is
  double margin = 0;  ///< over the next best
};

/// 97.5 % quantile of Student's t.
double student95(double freedom);

/// Nothing where too few echoes stand out of the noise or the order as it is fits as well. Of two orders that mirror
/// each other only what moves tells which: transmitters take turns, and a mirrored array would see it move backwards.
std::optional<ChannelOrder> findChannelOrder(const ChannelData& data);
/// Nothing where the echoes are array responses as they are, or too few to say so.
std::optional<ChannelErrors> findChannelErrors(const ChannelData& data);
/// Widens the standard errors of channel gains that a hypothesis fits to what echoes alone say of them: a likelihood
/// that takes the twin's echoes for exact would have them ten times too narrow.
void widenGains(const ChannelData& data, const Hypothesis& hypothesis, std::vector<double>& standard_error);
/// Share of a channel vector's power that the best single direction explains.
double arrayShare(const RadarConfig& radar, const Eigen::VectorXcd& channels);

}  // namespace mmradartwin::diagnosis::receiver
