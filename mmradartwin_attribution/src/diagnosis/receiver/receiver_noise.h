#pragma once

#include <optional>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::receiver {

/// Finding of noise that departs from the level that the twin's noise_floor states; nothing where it does not.
std::optional<Finding> noiseFloorFinding(const ChannelData& data, const NamedParameters& stated);

}  // namespace mmradartwin::diagnosis::receiver
