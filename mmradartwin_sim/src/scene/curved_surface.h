#pragma once

#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// Facets of an actor, five and more, that folds of less than 32 deg join: ids. weld: as below.
std::vector<std::vector<int>> smoothParts(const Scene& scene, const Actor& actor, const std::vector<int>& weld);

/// Spheres and straight circular cylinders that tessellated parts of an actor stand for: facets joined by folds of less
/// than 32 deg (12 sides and more) whose vertices lie on one such surface, over an arc of 60 deg and more. weld: the
/// actor's vertices, each by the first at its place. Sets Facet::curved of what was found.
void findCurvedSurfaces(Scene& scene, int actor, const std::vector<int>& weld);

}  // namespace mmradartwin
