#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::receiver {

/// Tie between the errors of channels: one error per transmitter, one per receiver and one per transmitter, or one per
/// channel.
enum class ChannelTie { kTransmitters, kReceivers, kFree };

/// Errors of the radar's channels as echoes tell them without a scene. An echo from one direction is an array response,
/// whatever the direction is; errors of channels are common to all echoes beside it.
struct ChannelErrors {
  /// Errors [M] relative to channel 0. A slope over the array cannot be told from a turn of the radar: it is taken as
  /// none where receivers differ at all.
  Eigen::VectorXd phase_rad, gain_db;
  /// Standard errors [M]; that of a phase holds the slope that errors of this size would have by chance.
  Eigen::VectorXd phase_error_rad, gain_error_db;
  ChannelTie tie = ChannelTie::kFree;
  double apart_rad = 0;        ///< largest difference of a receiver's phase between transmitters, where nothing is tied
  double gain = 0;             ///< nats over no errors
  double held_out_gain = 0;    ///< nats of echoes at ranges (or places) that the fit did not see
  int echoes = 0, groups = 0;  ///< numbers of echoes, and of their groups, from which standard errors are read
};

/// Order of channels that fits the echoes best.
struct ChannelOrder {
  std::vector<int> order;  ///< order[i] is the true channel that stands in place i
  double gain = 0;         ///< nats over the order as it is
  double margin = 0;       ///< nats over the next best order
};

/// 97.5 % quantile of Student's t.
double student95(double freedom);

/// Finds another order of channels. Nothing where too few echoes stand out of the noise or the order as it is fits as
/// well. Only movers tell mirrored orders apart: transmitters take turns, and a mirrored array sees a mover go
/// backwards.
std::optional<ChannelOrder> findChannelOrder(const ChannelData& data);
/// Finds errors of channels. Nothing where the echoes are array responses as they are, or too few to say so.
std::optional<ChannelErrors> findChannelErrors(const ChannelData& data);
/// Widens the standard errors of channel gains that a hypothesis fits to those that echoes alone give: a likelihood
/// that takes the twin's echoes for exact has them ten times too narrow.
void widenGains(const ChannelData& data, const Hypothesis& hypothesis, std::vector<double>& standard_error);
/// Share of a channel vector's power that the best single direction explains.
double arrayShare(const RadarConfig& radar, const Eigen::VectorXcd& channels);

}  // namespace mmradartwin::diagnosis::receiver
