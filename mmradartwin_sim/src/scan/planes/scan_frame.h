#pragma once

#include <vector>

#include "scan/planes/plane_regions.h"

namespace mmradartwin {

/// Metres per unit of a scan's file, by its size. Throws InputError where no unit makes a room of it.
double unitOfScan(const RawScan& scan);

/// Finds up, level and floor from the planes, and turns samples and planes into map. Throws InputError where there is
/// no floor or nothing upright.
ScanFrame bringIntoMap(const RawScan& scan, const ScanOptions& options, double unit_m, ScanSamples& samples,
                       std::vector<PlaneRegion>& regions);

}  // namespace mmradartwin
