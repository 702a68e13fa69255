#include "mmradartwin_sim/mesh_frame.h"

#include "scene/declared_frame.h"

namespace mmradartwin {

Eigen::Matrix3d MeshFrame::toUpright() const {
  return unit_m.value_or(1) * (y_up.value_or(false) ? uprightFromYUp() : Eigen::Matrix3d::Identity());
}

}  // namespace mmradartwin
