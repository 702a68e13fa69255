#pragma once

#include <vector>

#include "hypothesis_fit.h"

namespace mmradartwin {

/// Hypotheses that the latents have stood in for: what all headings and ranges, or the levels of one material's actors
/// have in common beyond what such errors are. Each with the start that the latents give; poses: looked at for slopes.
std::vector<Screened> sharedLatents(EchoSource& source, const ModelState& null, const LatentSpread& spread,
                                    const PoseAccuracy& accuracy, const std::vector<Hypothesis>& all,
                                    const std::vector<int>& poses);

}  // namespace mmradartwin
