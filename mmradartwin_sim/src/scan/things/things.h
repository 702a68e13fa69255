#pragma once

#include <string>
#include <vector>

#include "scan/planes/room_planes.h"

namespace mmradartwin {

/// What stands off the planes of a room.
struct Things {
  std::vector<ScanThing> things;
  std::vector<std::vector<int>> samples;  ///< of each thing
  std::size_t crumbs = 0;                 ///< samples in clusters too small for a thing
  std::size_t scraps = 0;                 ///< samples of small things of no sure class, which are left out
  std::vector<std::string> notes;
};

/// Clusters what no plane holds, cuts it at table tops, and gives each part the simplest shape that fits within the
/// scan's noise. `regions` are all flat parts, in map.
Things thingsOf(const RawScan& scan, const ScanFrame& frame, const ScanOptions& options, const ScanSamples& samples,
                const std::vector<PlaneRegion>& regions, const RoomPlanes& room);

}  // namespace mmradartwin
