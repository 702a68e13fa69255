#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <unordered_set>
#include <vector>

namespace mmradartwin {

/// Cells of a plane that hold something.
class CellRaster {
 public:
  explicit CellRaster(double side_m) : side_m_(side_m) {}
  void set(const Eigen::Vector2d& p) { cells_.insert(key(index(p.x()), index(p.y()))); }
  bool has(int x, int y) const { return cells_.count(key(x, y)) > 0; }
  int index(double at_m) const { return static_cast<int>(std::floor(at_m / side_m_)); }
  double side_m() const { return side_m_; }
  double area_m2() const { return static_cast<double>(cells_.size()) * side_m_ * side_m_; }
  /// Share of the cells with their centre in a box that are set.
  double share(const Eigen::AlignedBox2d& box) const;

 private:
  static std::int64_t key(int x, int y) { return (static_cast<std::int64_t>(x) << 32) ^ static_cast<std::uint32_t>(y); }

  double side_m_;
  std::unordered_set<std::int64_t> cells_;
};

/// Connected cells of an area that are not set.
struct RasterGap {
  Eigen::AlignedBox2d box;
  double area_m2 = 0;
  double fill = 0;            ///< share of the box
  bool touches_side = false;  ///< the area's left, right or upper end
};

/// Gaps of an area after cells of which most neighbours are set have been set, too.
std::vector<RasterGap> gapsOf(const CellRaster& raster, const Eigen::AlignedBox2d& area);

}  // namespace mmradartwin
