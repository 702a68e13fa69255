#pragma once

#include <Eigen/Geometry>
#include <array>
#include <boost/functional/hash.hpp>
#include <functional>
#include <unordered_set>
#include <vector>

namespace mmradartwin {

/// Cells, as a radar resolves them, within which scatter points of one facet are one path with their power, at the
/// place and with the phase of the one that lies nearest to their mean: thousands of points become a hundred where the
/// phases between them say nothing.
struct ScatterCells {
  using Cell = std::array<int, 4>;  ///< facet, range, sine, elevation
  using CellSet = std::unordered_set<Cell, boost::hash<Cell>>;

  Eigen::Isometry3d T_map_radar;  ///< about which the cells lie, wherever a mechanism moves the radar
  double range_m;                 ///< their size in slant range,
  double sine;                    ///< in the sine of the direction along the array
  double elevation_sine;          ///< and upwards
  /// Points that it tells apart share no cell; may be null.
  std::function<std::vector<char>(const std::vector<Eigen::Vector3d>& points)> sides = {};
  /// With PoseContext::change: filled with the cells that it touches, whose paths alone are added; may be null.
  CellSet* touched = nullptr;

  /// A point's place in units of the cells' size.
  Eigen::Array3d placeOf(const Eigen::Vector3d& point) const;
  Cell cellOf(int facet, const Eigen::Vector3d& point) const;
};

}  // namespace mmradartwin
