#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/echoes/echo_field.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis {

// Whether a twin and a recording belong together at all.

/// Throws InputError where the twin's radar has another number of channels or of range bins than the recording.
/// Carrier, slope and antenna positions may differ: they may be what is wrong with the twin.
void requireSameGrid(const Twin& twin, const RadarConfig& recorded);

/// Share of the measured power that chance explains: each pose's expected echoes are compared with the data of a pose
/// that stands or looks elsewhere. Nothing where all poses see the same.
std::optional<double> explainedByChance(const ChannelData& data, const std::vector<PoseEchoes>& echoes);

/// Finding that scene and recording do not belong together: the twin's expected echoes explain no more of the measured
/// power (explained_power) than they do after an exchange of poses. Nothing where they explain more, and nothing where
/// all poses see the same, so that an exchange shows nothing.
std::optional<Finding> nothingMatches(const ChannelData& data, const std::vector<PoseEchoes>& echoes,
                                      double explained_power);

}  // namespace mmradartwin::diagnosis
