#pragma once

#include <vector>

#include "scan/planes/wall_runs.h"
#include "scene/polygon_set.h"

namespace mmradartwin {

/// The floor reaches to the walls: of the cells that the walls' lines cut the plane into, those that hold the scan and
/// that no wall parts from the largest. In main coordinates. Walls that do not face these are those of a mirror's room,
/// or seen through a window: they leave `runs`.
PlaneLoops floorOutline(const RoomParts& room, std::vector<WallRun>& runs);

std::vector<Eigen::Vector2d> loopOf(const Eigen::AlignedBox2d& box);

}  // namespace mmradartwin
