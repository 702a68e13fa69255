#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace mmradartwin {

/// Lines at right angles that cut the floor into cells, in the room's main directions, and which cells are the room.
struct FloorCells {
  std::vector<double> xs, ys;
  std::vector<char> inside;  // [x][y]

  std::size_t index(std::size_t i, std::size_t k) const { return i * (ys.size() - 1) + k; }
  Eigen::AlignedBox2d box(std::size_t i, std::size_t k) const {
    return Eigen::AlignedBox2d(Eigen::Vector2d(xs[i], ys[k]), Eigen::Vector2d(xs[i + 1], ys[k + 1]));
  }
  bool holds(const Eigen::Vector2d& p) const {
    const auto i = std::upper_bound(xs.begin(), xs.end(), p.x()) - xs.begin(),
               k = std::upper_bound(ys.begin(), ys.end(), p.y()) - ys.begin();
    if (i < 1 || k < 1 || i >= static_cast<long>(xs.size()) || k >= static_cast<long>(ys.size())) return false;
    return inside[index(static_cast<std::size_t>(i) - 1, static_cast<std::size_t>(k) - 1)] != 0;
  }
};

/// From a cell to its neighbour: one of the two is 0, the other -1 or 1.
using CellStep = std::array<int, 2>;
/// True where a wall without a doorway stands between cell (i, k) and its neighbour.
using IsWalled = std::function<bool(std::size_t i, std::size_t k, const CellStep& step)>;

/// The room's cells: those that no wall parts from the first one and of which the scan has enough. share: of each
/// cell's area that the scan has.
void fillFrom(std::size_t first, const std::vector<double>& share, const IsWalled& is_walled, FloorCells& cells);
/// Cells that walls and the room enclose on three sides are the room's, though furniture hides what lies there.
void fillNooks(const IsWalled& is_walled, FloorCells& cells);

}  // namespace mmradartwin
