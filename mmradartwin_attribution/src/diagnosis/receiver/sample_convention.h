#pragma once

#include <optional>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::receiver {

/// How samples may have been delivered other than the convention has it: conjugated or in another order.
struct SampleConvention {
  NamedParameters mechanism;     ///< iq_conjugation, channel_conjugation or channel_permutation
  double gain = 0;               ///< nats over the delivery as it is said to be, on the poses looked at
  std::optional<double> margin;  ///< nats over the next best
};

/// Tries all deliveries on a part of the session; nothing where the data fit best as they are.
std::optional<SampleConvention> findSampleConvention(const Twin& twin, const ChannelData& data);
/// What leakage and echoes say without a scene, in the order in which it is to be undone.
std::vector<SampleConvention> findSampleConventionByEchoes(const ChannelData& data);
/// Undoes it in all poses.
void undoSampleConvention(const SampleConvention& delivery, ChannelData& data);
/// Undoes it in a frame; a conjugation of channels as the reversed order.
void undoSampleConvention(const SampleConvention& delivery, const RadarConfig& radar, AdcCube& frame);

}  // namespace mmradartwin::diagnosis::receiver
