#pragma once

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin::diagnosis::likelihood {

/// Fills the covariance that small things would have which no scene lists: as likely anywhere in the room as anywhere
/// else, each with power by r^-4, so that a wall close by leaves little room for them. The mean power of a cell at 3 m
/// is 1 over the session. One in twenty comes from nowhere in particular: no bin is left without.
void expectClutter(const Scene& scene, ChannelData& data);

}  // namespace mmradartwin::diagnosis::likelihood
