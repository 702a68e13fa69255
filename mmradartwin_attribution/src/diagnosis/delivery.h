#pragma once

#include <optional>
#include <vector>

#include "channel_data.h"
#include "echo_source.h"

namespace mmradartwin {

/// How samples may have been delivered other than the convention has it: conjugated or in another order.
struct Delivery {
  NamedParameters mechanism;     ///< iq_conjugation, channel_conjugation or channel_permutation
  double gain = 0;               ///< nats over the delivery as it is said to be, on the poses looked at
  std::optional<double> margin;  ///< nats over the next best
};

/// Tries all deliveries on a part of the session; nothing where the data fit best as they are.
std::optional<Delivery> findDelivery(const Twin& twin, const ChannelData& data);
/// What leakage and echoes say without a scene, in the order in which it is to be undone.
std::vector<Delivery> findDeliveryByEchoes(const ChannelData& data);
/// Undoes it in all poses.
void undoDelivery(const Delivery& delivery, ChannelData& data);
/// Undoes it in a frame; a conjugation of channels as the reversed order.
void undoDelivery(const Delivery& delivery, const RadarConfig& radar, AdcCube& frame);

}  // namespace mmradartwin
