#pragma once

#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/frames/frame_examiner.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis {

/// What frames show and neither a cause nor the twin explains, as the `unknown` that stands last, and its terms for the
/// extended twin. Its gain is one in nats per pose: maps of averages do not show it.
void addUnexplained(const std::vector<FrameFinding>& frames, const ChannelData& data,
                    const std::vector<NamedParameters>& stated, Findings& findings,
                    std::vector<NamedParameters>& extended);

}  // namespace mmradartwin::diagnosis
