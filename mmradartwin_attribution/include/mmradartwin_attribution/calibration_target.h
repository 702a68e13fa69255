#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// A target that the radar was held in front of: a corner reflector at a known place, or a wall of the scene.
struct CalibrationTarget {
  std::optional<Eigen::Vector3d> reflector_map_m;
  std::vector<Facet> wall;  ///< the actor's facets that reflect; the nearest faced one counts at each pose
  std::string name;
};
/// The facets of an actor of the scene. Throws InputError for an unknown actor or one without upright surfaces.
CalibrationTarget wallTarget(const Scene& scene, const std::string& actor);

}  // namespace mmradartwin
