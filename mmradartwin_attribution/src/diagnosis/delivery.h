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
/// Undoes it in all poses.
void undoDelivery(const Delivery& delivery, ChannelData& data);

}  // namespace mmradartwin
