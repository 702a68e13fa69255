#include "mmradartwin_sim/pose_context.h"

#include <cmath>

namespace mmradartwin {

namespace {
const double kSine = std::sin(20 * M_PI / 180);
}

bool inFieldOfView(const Eigen::Vector3d& direction_radar) {
  return direction_radar.x() > 0 && std::abs(direction_radar.z()) <= kSine * direction_radar.norm();
}

bool PoseContext::inFieldOfView(const Eigen::Vector3d& direction_radar) const {
  return mmradartwin::inFieldOfView(direction_radar);
}

}  // namespace mmradartwin
