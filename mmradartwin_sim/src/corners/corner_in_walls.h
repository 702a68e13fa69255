#pragma once

#include <vector>

#include "corners/corner_edge.h"
#include "physics/elements_in_map.h"
#include "physics/path_event.h"
#include "rays/image_paths.h"

namespace mmradartwin {

/// A concave edge as it is seen in mirrors: the way to it and back meets the same walls in turn and turns about at the
/// edge. Its order is even, and its line from the radar to its image runs through the edge, so that a search for images
/// does not find it.
struct CornerInWalls {
  const CornerEdge* edge;
  PerInteraction<int> walls;  ///< facet ids, in the order in which they are met on the way there
};

/// All edges seen in `walls` mirrors whose way is clear of other things. limits: of the search for images; its order
/// does not matter. reflectors: facets that may be mirrors.
std::vector<CornerInWalls> findCornersInWalls(const PoseContext& context, const ElementsInMap& elements,
                                              const std::vector<CornerEdge>& edges, const std::vector<int>& reflectors,
                                              int walls, const ImageSearch::Limits& limits);

/// The retro path over an edge seen in walls: Fresnel coefficients with polarisation, sqrt(1 - S^2) and the aperture
/// factors of walls, twice, and of the edge, spreading of the full length. Nothing is added where 20 log10(A_p) falls
/// below `cutoff` (an amplitude).
void addCornerInWalls(const PoseContext& context, const ElementsInMap& elements, const CornerInWalls& corner,
                      const PathEvent& event, double cutoff, std::vector<PathRecord>& records);

}  // namespace mmradartwin
