#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mmradartwin_attribution/diagnosis.h"

namespace mmradartwin {

struct Scene;

/// scene: null pointer where there is none.
SurveyPlan surveyPlan(const Scene* scene, const std::vector<Pose>& poses);

/// The maps' differences without and with the finding, where it has any, and the survey from above with the poses and
/// actors that carry it and the place where it sits.
cv::Mat drawFinding(const Finding& finding, const SurveyPlan& plan);

}  // namespace mmradartwin
