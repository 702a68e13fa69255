#pragma once

#include <vector>

#include "edges/grazed_edges.h"
#include "physics/elements_in_map.h"
#include "physics/path_event.h"
#include "rays/image_paths.h"

namespace mmradartwin {

/// The record of a closed specular path of two bounces or more: Fresnel coefficients with polarisation, sqrt(1 - S^2)
/// and the aperture factor of each facet, spreading of the full length, and what edges leave of it where they are
/// given. Nothing is added where 20 log10(A_p) falls below `cutoff` (an amplitude).
void addImageRecord(const PoseContext& context, const ElementsInMap& elements, const ImagePath& path,
                    const PathEvent& event, double cutoff, std::vector<PathRecord>& records,
                    const GrazedEdges* edges = nullptr);

}  // namespace mmradartwin
