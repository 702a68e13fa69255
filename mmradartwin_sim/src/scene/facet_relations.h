#pragma once

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// Facets nearer to each other than this and nearly parallel are layers: wider than what rays are cut short by.
constexpr double kLayer_m = 0.012;
/// Planes nearer to each other than this are one.
constexpr double kSamePlane_m = 1e-4;

/// Finds anew which facets of the scene lie over which (Facet::layers), and which claim the same area of one plane:
/// that is cut out of all but one of them (Scene::overlaps, uncut), by the rule of docs/reference/contracts.md
/// section 4.
void relateFacets(Scene& scene);

}  // namespace mmradartwin
