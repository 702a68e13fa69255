#pragma once

#include <string>
#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// Defects of meshes that are traced all the same, each kind in one sentence for whoever made the scene: bodies
/// that are open, surfaces of one actor that cut through each other, and what a scan's noise breaks into facets. Sheets
/// of one or two planes may be open. Rooms are made of sheets and scans have holes, so that neither is an error.
std::vector<std::string> meshNotes(const Scene& scene);

}  // namespace mmradartwin
