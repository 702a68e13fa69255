#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// " by origin: [x, y, z] in scene.yaml's entry of the mesh" with whole hundreds of metres near a far vertex.
std::string originAdvice(const Eigen::Vector3d& far_vertex);

/// Throws InputError for a mesh so far from the origin that single precision, which files and ray casting have, blurs
/// it: over 10 km away, and 1000 times as far as it is wide. origin: what was taken off already.
void refuseFarVertices(const std::string& file, const std::vector<Actor>& actors, const Eigen::Vector3d& origin);

}  // namespace mmradartwin
