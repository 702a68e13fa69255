#pragma once

#include <nlohmann/json.hpp>

#include "mmradartwin_attribution/evaluation.h"
#include "mmradartwin_attribution/run_description.h"

namespace mmradartwin::page {

/// What summary.json of an evaluation holds: every number of the report but those of single residuals, which stand in
/// residuals.csv.
nlohmann::json evaluationSummary(const Evaluation& evaluation, const AttributionConfig& config,
                                 const RunDescription& run);

}  // namespace mmradartwin::page
