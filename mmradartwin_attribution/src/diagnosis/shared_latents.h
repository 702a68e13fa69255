#pragma once

#include <vector>

#include "hypothesis_fit.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// Hypotheses that the latents have stood in for: what all headings, all ranges, or the levels of one material's actors
/// have in common beyond what such errors are. Each with the start that the latents give.
std::vector<Screened> sharedLatents(const Scene& scene, const Nuisance& n, const LatentSpread& spread,
                                    const PoseAccuracy& accuracy, const std::vector<Hypothesis>& all);

}  // namespace mmradartwin
