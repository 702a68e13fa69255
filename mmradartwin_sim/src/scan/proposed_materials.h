#pragma once

#include <string>
#include <vector>

#include "scan/samples/scan_samples.h"

namespace mmradartwin {

/// A material of each plane and thing, by its kind, and by colour where the scan has one.
std::vector<MaterialProposal> proposeMaterials(const ScanScene& scene, const std::vector<std::vector<int>>& of_things,
                                               const ScanSamples& samples);

}  // namespace mmradartwin
