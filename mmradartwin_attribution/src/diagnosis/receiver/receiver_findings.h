#pragma once

#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/frames/frame_examiner.h"
#include "diagnosis/receiver/body_fixed_tone.h"
#include "diagnosis/receiver/channel_errors.h"
#include "diagnosis/receiver/sample_convention.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::receiver {

// What is wrong with frames and the receiver, as findings; their gain in maps is left open.

Finding findingOf(const FrameFinding& frames);
/// False where a mechanism of the twin says the same: for the same thing, or for a place near by, and no value
/// farther from the finding's than its interval is wide.
bool differsFromStated(const Finding& f, const std::vector<NamedParameters>& stated);
Finding findingOf(const SampleConvention& delivery, const RadarConfig& radar);
/// rest: the data without the tone, whose strongest echo levels refer to.
Finding findingOf(const BodyFixedTone& tone, const ChannelData& rest);
Finding findingOf(const ChannelErrors& errors);

}  // namespace mmradartwin::diagnosis::receiver
