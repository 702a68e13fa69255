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

// Findings about frames and the receiver, without their gain in maps.

Finding findingOf(const FrameFinding& frames);
/// False where a mechanism of the twin states the finding already: it concerns the same thing or a nearby place, and no
/// value differs from the finding's by more than the width of its interval.
bool differsFromStated(const Finding& f, const std::vector<NamedParameters>& stated);
Finding findingOf(const SampleConvention& convention, const RadarConfig& radar);
/// rest: the data without the tone, to whose strongest echo levels refer.
Finding findingOf(const BodyFixedTone& tone, const ChannelData& rest);
Finding findingOf(const ChannelErrors& errors);

}  // namespace mmradartwin::diagnosis::receiver
