#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "scan/planes/plane_groups.h"

namespace mmradartwin {

/// A wall from one end to the other.
struct WallRun {
  std::size_t group;
  double from_m, to_m;
  double top_m = 0;
  std::vector<Eigen::AlignedBox2d> openings = {};
};
/// Runs of all walls: where a wall has samples over much of its height, its ends at the walls that cross it, with its
/// openings. closed_m2 grows by what of the walls the scan does not have though nothing hides it.
std::vector<WallRun> wallRuns(const RoomParts& room, double& closed_m2);

/// Both ends, in main coordinates.
std::array<Eigen::Vector2d, 2> endsOf(const RoomParts& room, const WallRun& run);

}  // namespace mmradartwin
