#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::receiver {

/// Constraint on the errors of channels: one error per transmitter, one per receiver and one per transmitter, or one
/// per channel.
enum class ChannelTie { kTransmitters, kReceivers, kFree };

/// Errors of the radar's channels that echoes show without a scene. An echo from one direction is an array response in
/// any direction; the deviations that all echoes share are the channels' errors.
struct ChannelErrors {
  /// Errors [M] relative to channel 0. A slope over the array is the same as a turn of the radar: it is set to zero
  /// where receivers differ.
  Eigen::VectorXd phase_rad, gain_db;
  /// Standard errors [M]. Those of phases include the slope that errors of this size have by chance.
  Eigen::VectorXd phase_error_rad, gain_error_db;
  ChannelTie tie = ChannelTie::kFree;
  double apart_rad = 0;  ///< largest difference of a receiver's phase between transmitters, with unconstrained errors
  double gain = 0;       ///< nats over no errors
  double held_out_gain = 0;    ///< nats of echoes at ranges (or locations) that the fit did not see
  int receivers = 0;           ///< of the radar: with one, a transmitter's error is that of a channel
  int echoes = 0, groups = 0;  ///< numbers of echoes, and of their groups, which give the standard errors
};

/// Order of channels that fits the echoes best.
struct ChannelOrder {
  std::vector<int> order;  ///< order[i] is the true channel at index i
  double gain = 0;         ///< nats over the delivered order
  double margin = 0;       ///< nats over the next best order
  /// Orders that the echoes do not tell from it, itself first, and the nats by which each is behind the best.
  std::vector<std::pair<std::vector<int>, double>> alike;
};

/// 97.5 % quantile of Student's t.
double student95(double freedom);

/// Finds another order of channels. Nothing where too few echoes exceed the noise, or where the delivered order fits as
/// well. Only moving echoes distinguish mirrored orders: transmitters take turns, and a mirrored array sees the echo
/// move backwards. Nothing where angle_slots leaves slots out.
std::optional<ChannelOrder> findChannelOrder(const ChannelData& data);
/// Finds errors of channels. Nothing where the echoes are array responses already, or where they are too few.
std::optional<ChannelErrors> findChannelErrors(const ChannelData& data);
/// Widens the standard errors of a hypothesis' channel gains to those that echoes alone give. A likelihood that takes
/// the twin's echoes as exact gives a tenth of them.
void widenGains(const ChannelData& data, const Hypothesis& hypothesis, std::vector<double>& standard_error);
/// Share of a channel vector's power that the best single direction explains, on the line of the angle transform.
double arrayShare(const RadarConfig& radar, const Eigen::VectorXcd& channels);

}  // namespace mmradartwin::diagnosis::receiver
