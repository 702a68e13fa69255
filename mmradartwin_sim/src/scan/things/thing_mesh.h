#pragma once

#include <vector>

#include "scan/samples/scan_samples.h"

namespace mmradartwin {

/// The scan's own surface of a thing, welded, with fewer triangles: sharp edges stay, and no vertex goes by more than
/// options.silhouette_m (Schroeder et al., Decimation of Triangle Meshes, 1992). A cloud is meshed first (Marton et
/// al., On Fast Surface Reconstruction Methods, 2009). False where nothing comes of it.
bool addMesh(const RawScan& scan, const ScanSamples& samples, const ScanFrame& frame, const ScanOptions& options,
             const std::vector<int>& indices, ScanThing& thing);

}  // namespace mmradartwin
