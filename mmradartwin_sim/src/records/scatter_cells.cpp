#include "mmradartwin_sim/scatter_cells.h"

#include <algorithm>

namespace mmradartwin {

Eigen::Array3d ScatterCells::placeOf(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d way = T_map_radar.linear().transpose() * (point - T_map_radar.translation());
  const double r = std::max(1e-6, way.norm());
  return {r / range_m, way.y() / r / sine, way.z() / r / elevation_sine};
}

ScatterCells::Cell ScatterCells::cellOf(int facet, const Eigen::Vector3d& point) const {
  const Eigen::Array3i at = placeOf(point).floor().cast<int>();
  return {facet, at.x(), at.y(), at.z()};
}

}  // namespace mmradartwin
