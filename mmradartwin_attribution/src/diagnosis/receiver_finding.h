#pragma once

#include <optional>

#include "body_fixed_tone.h"
#include "channel_data.h"
#include "delivery.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_attribution/frame_evidence.h"

namespace mmradartwin {

// What is wrong with frames and the receiver, as findings; their gain on held-out places is left open.

Finding findingOf(const FrameFinding& frames);
/// What frames show and no cause explains, as the `unknown` that stands last.
void addUnexplained(const FrameExaminer& frames, std::vector<Finding>& findings);
Finding findingOf(const Delivery& delivery, const RadarConfig& radar);
/// rest: the data without the tone, whose strongest echo levels refer to.
Finding findingOf(const BodyFixedTone& tone, const ChannelData& rest);
/// Where the noise departs from the level that the twin's noise_floor states.
std::optional<Finding> noiseFloorFinding(const ChannelData& data, const NamedParameters& stated);

}  // namespace mmradartwin
