#pragma once

#include <optional>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::receiver {

/// Finding of a noise level other than the one that the twin's noise_floor states; nothing where they agree.
std::optional<Finding> noiseFloorFinding(const ChannelData& data, const NamedParameters& stated);

}  // namespace mmradartwin::diagnosis::receiver
