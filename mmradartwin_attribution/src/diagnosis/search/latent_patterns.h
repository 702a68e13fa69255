#pragma once

#include <optional>
#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// Hypotheses for which latents stand in: errors that all headings and ranges, or the levels of one material's actors,
/// have in common, beyond the size of such errors. Each has the start that the latents give. A geometry whose common
/// error is no larger promises nothing, but has its start. poses: at which slopes are taken.
std::vector<Screened> sharedLatents(ExpectedEchoes& source, const ModelState& null, const LatentSpread& spread,
                                    const PoseAccuracy& accuracy, const std::vector<Hypothesis>& all,
                                    const std::vector<int>& poses);

/// Named hypothesis that a law looks like, with the start that the law gives; nothing for other laws. Delays over
/// azimuth look like an offset of the radar (-(forward cos + left sin)), delays over the direction in map like one of
/// the scene (x cos + y sin), levels over range like an attenuation, levels over time like a drift.
std::optional<Screened> namedLike(const Screened& law, const std::vector<Hypothesis>& all);

}  // namespace mmradartwin::diagnosis::search
