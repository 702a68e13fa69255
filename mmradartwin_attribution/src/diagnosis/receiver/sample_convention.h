#pragma once

#include <optional>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::receiver {

/// Convention other than the twin's in which samples were delivered: conjugated or in another order.
struct SampleConvention {
  NamedParameters mechanism;     ///< iq_conjugation, channel_conjugation or channel_permutation
  double gain = 0;               ///< nats over the stated convention, on the poses that were looked at
  std::optional<double> margin;  ///< nats over the next best convention
};

/// Tries all conventions on a part of the session; nothing where the data fit best as they are.
std::optional<SampleConvention> findSampleConvention(const Twin& twin, const ChannelData& data);
/// Conventions that leakage and echoes tell without a scene, in the order in which they are to be undone.
std::vector<SampleConvention> findSampleConventionByEchoes(const ChannelData& data);
/// Undoes a convention in all poses.
void undoSampleConvention(const SampleConvention& convention, ChannelData& data);
/// Undoes a convention in a frame; conjugated channels count as channels in reversed order.
void undoSampleConvention(const SampleConvention& convention, const RadarConfig& radar, AdcCube& frame);

}  // namespace mmradartwin::diagnosis::receiver
