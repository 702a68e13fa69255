#pragma once

#include <functional>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/evaluation.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::gain {

/// Fills the paper's metrics (recall by band, Q1, Q2, Q3, counts of C1 to C5) over the poses in `data`, before and
/// after, with 95 % intervals of their differences by bootstrap over locations. after: mechanisms by fold, or one list
/// for all folds. fold_of: fold of a location's index. Poses without an uncorrected average are left out.
void addMapMetrics(const Recording& recording, const Twin& twin, const ChannelData& data,
                   const std::vector<NamedParameters>& before, const std::vector<std::vector<NamedParameters>>& after,
                   const std::function<int(int)>& fold_of, const EvaluationOptions& options, FindingGain& gain);

}  // namespace mmradartwin::diagnosis::gain
