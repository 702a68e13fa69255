#pragma once

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/scene_refinement.h"

namespace mmradartwin::diagnosis {

/// Ranges of actors about a state of the twin, and what they gain on locations that have no part in them.
SceneRefinement refinedRanges(DiagnosisContext& context, const ModelState& state);

}  // namespace mmradartwin::diagnosis
