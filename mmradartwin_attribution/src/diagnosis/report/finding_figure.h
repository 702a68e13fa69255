#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_result.h"

namespace mmradartwin::diagnosis::report {

/// Figure of a finding: the maps' differences without and with it, where the finding has maps, and beside them the
/// survey from above with the finding's poses, actors and places.
cv::Mat drawFinding(const Finding& finding, const SurveyPlan& plan);
/// The parts of drawFinding() one by one, with letters that stay readable when they are shown small.
struct FindingParts {
  cv::Mat before, after;  ///< empty where the finding has no maps
  cv::Mat plan;
};
FindingParts drawFindingParts(const Finding& finding, const SurveyPlan& plan);

}  // namespace mmradartwin::diagnosis::report
