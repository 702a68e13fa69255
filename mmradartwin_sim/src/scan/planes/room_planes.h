#pragma once

#include <string>
#include <vector>

#include "scan/planes/plane_regions.h"

namespace mmradartwin {

/// The planes of a room, and what of the scan lies on them.
struct RoomPlanes {
  std::vector<ScanPlane> planes;
  std::vector<int> owner;  ///< of each sample: index into planes; -1 none; -2 a second copy of a plane, left out
  double yaw_rad = 0;      ///< of the room's main direction in map, 0 to 90 deg
  double height_m = 0;     ///< of the walls
  double closed_m2 = 0;    ///< of walls that the scan does not have and nothing hides
  double doubled_m2 = 0;   ///< of second copies
  std::vector<std::string> notes;
};

/// Floor, ceiling and walls with exact bounds. Everything is in map. shifts: of upright planes, before their bounds are
/// found. Throws InputError where there is no wall.
RoomPlanes roomPlanes(const std::string& file, const ScanFrame& frame, const ScanSamples& samples,
                      const std::vector<PlaneRegion>& regions, double yaw_rad, const std::vector<PlaneShift>& shifts);

}  // namespace mmradartwin
