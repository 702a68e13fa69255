#pragma once

#include <optional>
#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// Hypotheses that the latents have stood in for: what all headings and ranges, or the levels of one material's actors
/// have in common beyond what such errors are. Each with the start that the latents give; poses: looked at for slopes.
/// A geometry that they have no more of than that promises nothing, but its start is told.
std::vector<Screened> sharedLatents(ExpectedEchoes& source, const ModelState& null, const LatentSpread& spread,
                                    const PoseAccuracy& accuracy, const std::vector<Hypothesis>& all,
                                    const std::vector<int>& poses);

/// The named hypothesis that a law looks like, with the start that the law gives: of delays over azimuth an offset of
/// the radar (-(forward cos + left sin)), over the direction in map one of the scene (x cos + y sin); of levels over
/// range an attenuation, over time a drift. None for other laws.
std::optional<Screened> namedLike(const Screened& law, const std::vector<Hypothesis>& all);

}  // namespace mmradartwin::diagnosis::search
