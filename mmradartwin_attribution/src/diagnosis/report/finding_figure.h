#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_result.h"

namespace mmradartwin::diagnosis::report {

/// The maps' differences without and with the finding, where it has any, and the survey from above with the poses and
/// actors that carry it and the place where it sits.
cv::Mat drawFinding(const Finding& finding, const SurveyPlan& plan);

}  // namespace mmradartwin::diagnosis::report
