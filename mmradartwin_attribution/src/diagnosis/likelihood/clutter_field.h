#pragma once

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin::diagnosis::likelihood {

/// Fills PoseChannels::clutter, the covariance of small things that no scene lists. They are equally likely anywhere in
/// the room, each with a power that falls as r^-4. The mean power of a cell at 3 m over the session is 1. Another 5 %
/// that falls as r^-3 is independent between channels and has no place.
void expectClutter(const Scene& scene, ChannelData& data);

}  // namespace mmradartwin::diagnosis::likelihood
