#pragma once

#include <functional>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/evaluation.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::gain {

/// The paper's metrics of the poses in `data` (recall by band, Q1, Q2, Q3, C1 to C5) before and after, and their
/// differences' 95 % intervals by bootstrap over locations. After: mechanisms by fold, or one list for all; `fold_of` a
/// location. Poses without a plain average are left out.
void addMapMetrics(const Recording& recording, const Twin& twin, const ChannelData& data,
                   const std::vector<NamedParameters>& before, const std::vector<std::vector<NamedParameters>>& after,
                   const std::function<int(int)>& fold_of, const EvaluationOptions& options, FindingGain& gain);

}  // namespace mmradartwin::diagnosis::gain
