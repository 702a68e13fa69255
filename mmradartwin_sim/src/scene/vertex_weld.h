#pragma once

#include <Eigen/Core>
#include <vector>

namespace mmradartwin {

/// Index of the first vertex at (nearly) the same place, per vertex: meshes repeat vertices per triangle.
std::vector<int> weldVertices(const std::vector<Eigen::Vector3d>& vertices);

}  // namespace mmradartwin
