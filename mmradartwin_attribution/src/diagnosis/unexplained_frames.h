#pragma once

#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/frames/frame_examiner.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis {

/// Adds what frames show and no cause explains to the findings, as an `unknown` that stands last or as a part of the
/// one that does, and its terms to the mechanisms of the extended twin. Leaves out what a stated mechanism says
/// already. The gain is told in nats per pose: maps of averages do not show it.
void addUnexplained(const std::vector<FrameFinding>& frames, const ChannelData& data,
                    const std::vector<NamedParameters>& stated, Findings& findings,
                    std::vector<NamedParameters>& extended);

}  // namespace mmradartwin::diagnosis
