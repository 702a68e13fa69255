#include "mmradartwin_sim/pose_context.h"

#include <cmath>

namespace mmradartwin {

bool inFieldOfView(const Eigen::Vector3d& direction_radar, double most_elevation_deg) {
  static const double kBaseSine = std::sin(kBaseElevation_deg * M_PI / 180);
  const double sine = most_elevation_deg == kBaseElevation_deg ? kBaseSine : std::sin(most_elevation_deg * M_PI / 180);
  return direction_radar.x() > 0 && std::abs(direction_radar.z()) <= sine * direction_radar.norm();
}

bool PoseContext::inFieldOfView(const Eigen::Vector3d& direction_radar) const {
  return mmradartwin::inFieldOfView(direction_radar, most_elevation_deg);
}

}  // namespace mmradartwin
