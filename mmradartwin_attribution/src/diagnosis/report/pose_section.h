#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosed_poses.h"
#include "page/page_numbers.h"
#include "page/page_values.h"

namespace mmradartwin::diagnosis::report {

/// Names that addPoseValues() fills, for pageNames().
inline constexpr const char* kPoseNames =
    "has_poses[] has_corrected[] shown_poses[rank pose measured sentence corrected[sentence simulated difference] "
    "simulated difference] poses[pose given corrected[share matched] matched] ";

/// Adds to summary.json of a diagnosis what the twin explains of each pose, as given and corrected ("poses"), and the
/// poses' names, the one that the twin as given explains least first ("worst_first").
void addPoseSummary(const DiagnosedPoses& poses, nlohmann::json& summary);

/// The worst poses and the best one with their maps, and a table of all. summary: as addPoseSummary() left it; poses:
/// nullptr for none.
void addPoseValues(const DiagnosedPoses* poses, const page::PageNumbers& summary, page::PageValues& values);

}  // namespace mmradartwin::diagnosis::report
