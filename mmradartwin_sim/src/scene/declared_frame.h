#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

struct aiScene;

namespace mmradartwin {

/// What a mesh file says itself of its axes and unit.
struct DeclaredFrame {
  std::optional<Eigen::Matrix3d> upright;  ///< turns assimp's coordinates to z up
  std::optional<double> unit_m;            ///< of assimp's coordinates
};

/// Turns y-up coordinates to z up: x stays.
Eigen::Matrix3d uprightFromYUp();

/// Of a file with this extension (lower case, with its dot) as assimp has read it. glTF is y-up in metres by its
/// specification. Collada declares both, y-up metres by default, and assimp honours it by y-up metres. FBX declares
/// both in its global settings, of which assimp makes no use.
DeclaredFrame declaredFrame(const std::string& extension, const aiScene& scene);

}  // namespace mmradartwin
