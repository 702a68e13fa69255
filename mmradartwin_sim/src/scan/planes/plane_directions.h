#pragma once

#include <vector>

#include "scan/planes/plane_regions.h"

namespace mmradartwin {

/// Turns planes of one direction into exact parallels, level ones and upright ones, as far as three of their standard
/// deviations; their offsets are fitted again. Returns the room's main direction.
double regularise(const ScanSamples& samples, bool enabled, std::vector<PlaneRegion>& regions);

}  // namespace mmradartwin
