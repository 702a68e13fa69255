#pragma once

#include "mmradartwin_sim/scan_to_scene.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// Facets of a scan's actors as the simulator makes them, in the order of ScanScene::actors. Materials are not set.
Scene tracedActors(const ScanScene& scan);

}  // namespace mmradartwin
