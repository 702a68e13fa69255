#pragma once

#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// Finds the closed parts of an actor: triangles that hang together by their edges, each edge joining two of them,
/// which enclose a volume. How the file winds them means nothing. Sets Facet::body and outside. weld: the actor's
/// vertices, each by the first at its place.
void findClosedBodies(Scene& scene, int actor, const std::vector<int>& weld);

}  // namespace mmradartwin
