#pragma once

#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/frames/frame_finding.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis {

/// Takes walkers out of the findings that the scene hides from every pose that sees them: nobody is seen through a
/// wall. One that no visible walker accounts for as an echo by way of a wall becomes an `unknown`.
void judgeHiddenWalkers(const Twin& twin, const ChannelData& data, std::vector<FrameFinding>& frames,
                        std::vector<FrameFinding>& unexplained);

}  // namespace mmradartwin::diagnosis
