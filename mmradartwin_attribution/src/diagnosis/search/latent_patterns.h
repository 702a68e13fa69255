#pragma once

#include <optional>
#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// Hypotheses that latents have absorbed: errors that all headings and ranges, or the levels of one material's actors,
/// have in common, and that exceed the size of such errors. The latents give each a start. A geometry whose common
/// error is no larger has its start but no screened gain. poses: those at which slopes are taken.
std::vector<Screened> sharedLatents(ExpectedEchoes& source, const ModelState& null, const LatentSpread& spread,
                                    const PoseAccuracy& accuracy, const std::vector<Hypothesis>& all,
                                    const std::vector<int>& poses);

/// Named hypothesis that a law resembles, with the start that the law gives; nothing for other laws. Delays over
/// azimuth resemble an offset of the radar (-(forward cos + left sin)), delays over the direction in map one of the
/// scene (x cos + y sin), levels over range an attenuation, levels over time a drift.
std::optional<Screened> namedLike(const Screened& law, const std::vector<Hypothesis>& all);

}  // namespace mmradartwin::diagnosis::search
