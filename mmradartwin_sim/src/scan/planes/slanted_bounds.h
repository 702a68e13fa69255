#pragma once

#include <vector>

#include "scan/planes/plane_regions.h"
#include "scene/polygon_set.h"

namespace mmradartwin {

/// Coordinates in a plane: q is at origin + q.x u + q.y v.
struct PlaneAxes {
  Eigen::Vector3d origin, u, v;
};

/// Nothing of the scan is behind a plane that bounds the room. Its normal points into the room.
bool boundsRoom(const ScanSamples& samples, const PlaneRegion& region);

/// Slanted planes that bound the room from above: lower faces of a roof. Their normals point into the room.
std::vector<PlaneRegion> slantedBounds(const ScanSamples& samples, const std::vector<PlaneRegion>& regions,
                                       double height_m);

/// What of a rectangle in another plane lies behind a slanted plane: a convex loop, counter-clockwise, or none.
PlaneLoops behindSlant(const PlaneRegion& slant, const PlaneAxes& axes, const Eigen::AlignedBox2d& box);

}  // namespace mmradartwin
