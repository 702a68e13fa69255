#pragma once

#include <vector>

#include "mmradartwin_attribution/diagnosis_result.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin::diagnosis {

/// The survey seen from above: upright surfaces of the scene, and where the radar stood and looked. scene: null where
/// there is none.
SurveyPlan surveyPlan(const Scene* scene, const std::vector<Pose>& poses);

}  // namespace mmradartwin::diagnosis
