#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace mmradartwin {

struct Actor;

/// How the coordinates of a mesh file become metres with z up, as scene.yaml states it for files that do not declare it
/// themselves (Collada, FBX and glTF do).
struct MeshFrame {
  std::optional<bool> y_up;
  std::optional<double> unit_m;                      ///< metres per unit of the file
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< taken off, in metres with z up

  /// Linear map of the file's coordinates to metres with z up.
  Eigen::Matrix3d toUpright() const;
};

/// loadMesh() with what scene.yaml states: upright coordinates in metres, less the origin. Throws InputError also where
/// the file declares axes or unit itself and others are stated, and where its coordinates are too large for it to tell
/// its vertices apart.
std::vector<Actor> loadMesh(const std::string& file, const MeshFrame& stated);

}  // namespace mmradartwin
