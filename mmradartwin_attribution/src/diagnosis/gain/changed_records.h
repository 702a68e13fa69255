#pragma once

#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::gain {

/// Path records that differ between two lists of mechanisms of one twin, `before` and `after`, at the given poses (all
/// where none is given), at most ten poses. Paths of one mechanism over the same facets and actors count as one record,
/// with their summed power and the power-weighted means of range and azimuth. The strongest of each pose come first, at
/// most 20.
std::vector<ChangedRecord> changedRecords(const Twin& twin, const ChannelData& data,
                                          const std::vector<std::string>& poses,
                                          const std::vector<NamedParameters>& before,
                                          const std::vector<NamedParameters>& after);

}  // namespace mmradartwin::diagnosis::gain
