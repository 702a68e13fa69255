#pragma once

#include <Eigen/Core>
#include <vector>

namespace mmradartwin {

/// Closed loops in a plane, outer ones counter-clockwise, holes clockwise.
using PlaneLoops = std::vector<std::vector<Eigen::Vector2d>>;

/// Area within loops, less their holes.
double areaWithin(const PlaneLoops& loops);
/// What lies within both. Empty where the loops bound no proper area (crossing themselves).
PlaneLoops commonPart(const PlaneLoops& a, const PlaneLoops& b);
/// What lies within a and not within b; a itself where the loops bound no proper area.
PlaneLoops without(const PlaneLoops& a, const PlaneLoops& b);

}  // namespace mmradartwin
