#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::receiver {

/// Convention of delivered samples that differs from the twin's: conjugation or another order of channels.
struct SampleConvention {
  NamedParameters mechanism;     ///< iq_conjugation, channel_conjugation or channel_permutation
  double gain = 0;               ///< nats over the stated convention, on a part of the poses
  std::optional<double> margin;  ///< nats over the next best convention
  /// Conventions that the data do not tell apart, itself first, and the probability of each. Empty: itself alone.
  std::vector<std::pair<NamedParameters, double>> alike = {};
};

/// Tries all conventions on a part of the session. Nothing where the data fit best as delivered.
std::optional<SampleConvention> findSampleConvention(const Twin& twin, const ChannelData& data);
/// Conventions that leakage and echoes show without a scene, in the order in which they are to be undone.
std::vector<SampleConvention> findSampleConventionByEchoes(const ChannelData& data);
/// Undoes a convention in all poses.
void undoSampleConvention(const SampleConvention& convention, ChannelData& data);
/// Undoes a convention in a frame. Conjugated channels count as channels in reversed order.
void undoSampleConvention(const SampleConvention& convention, const RadarConfig& radar, AdcCube& frame);

}  // namespace mmradartwin::diagnosis::receiver
