#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace mmradartwin {

/// A triangle near a plane: vertices by number and by place, counter-clockwise; z is the height over the plane.
struct PlaneTriangle {
  std::array<int, 3> corner;
  std::array<Eigen::Vector3d, 3> place;
};

/// Which triangles lie on earlier ones for their whole area, within same_m of height and however both are cut: places
/// in the list, rising. Looks closer only where edges or angles about a vertex say that some do.
std::vector<std::size_t> repeatedTriangles(const std::vector<PlaneTriangle>& triangles, double same_m);

}  // namespace mmradartwin
