#pragma once

#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::gain {

/// The path records that `after` has otherwise than `before`, two lists of mechanisms of one twin, at the poses named
/// (all of them where none is): those of one mechanism by the same facets and actors are told as one, with their power
/// and its means of place. The strongest of each pose first, at most 20 of each.
std::vector<ChangedRecord> changedRecords(const Twin& twin, const ChannelData& data,
                                          const std::vector<std::string>& poses,
                                          const std::vector<NamedParameters>& before,
                                          const std::vector<NamedParameters>& after);

}  // namespace mmradartwin::diagnosis::gain
