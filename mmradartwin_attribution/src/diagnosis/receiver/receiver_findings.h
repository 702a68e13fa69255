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

// Findings about frames and the receiver; their gain in maps is left open.

Finding findingOf(const FrameFinding& frames);
/// False where a mechanism of the twin states the finding already: it is about the same thing, or a place near by, and
/// no value is farther from the finding's than the width of its interval.
bool differsFromStated(const Finding& f, const std::vector<NamedParameters>& stated);
Finding findingOf(const SampleConvention& convention, const RadarConfig& radar);
/// `rest` is the data without the tone: levels refer to its strongest echo.
Finding findingOf(const BodyFixedTone& tone, const ChannelData& rest);
Finding findingOf(const ChannelErrors& errors);

}  // namespace mmradartwin::diagnosis::receiver
