#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/likelihood/echo_field.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis {

// Whether a twin and a recording belong together at all.

/// Throws InputError where the twin's radar has other channels or other range bins than the recording; else it may be
/// another one.
void requireSameGrid(const Twin& twin, const RadarConfig& recorded);

/// Throws InputError where a pose stands so far outside the scene that units or origin must differ. source: of the
/// poses.
void requirePlacesNear(const Scene& scene, const ChannelData& data, const std::string& source);

/// The only finding where what a twin expects explains (explained_power) no more than it does with the poses exchanged;
/// nothing where it does, and where all poses see the same.
std::optional<Finding> nothingMatches(const ChannelData& data, const std::vector<PoseEchoes>& echoes,
                                      double explained_power);

}  // namespace mmradartwin::diagnosis
