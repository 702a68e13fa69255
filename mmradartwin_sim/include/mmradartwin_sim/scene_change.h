#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "mmradartwin_sim/path_record.h"

namespace mmradartwin {

/// Actors that moved while the radar stood, and the space that they left and took: a path that neither meets nor
/// crosses any of it is as it was.
struct SceneChange {
  std::vector<int> actors;                  ///< Scene::actors index
  std::vector<Eigen::AlignedBox3d> bounds;  ///< map, with a margin; where they were and where they are

  /// Adds bounds with the margin that what touches an actor's faces needs.
  void addBounds(const Eigen::AlignedBox3d& box);
  bool moved(int actor) const { return std::find(actors.begin(), actors.end(), actor) != actors.end(); }
  /// True where the segment comes into one of the bounds.
  bool crosses(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const;
  /// True where a path from the radar and back may be another after the change.
  bool touches(const Eigen::Vector3d& radar, const PathRecord& record) const;
};

}  // namespace mmradartwin
