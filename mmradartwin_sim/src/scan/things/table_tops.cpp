#include "scan/things/table_tops.h"

#include <algorithm>
#include <cmath>

namespace mmradartwin {
namespace {

/// A low top with a back over its rim, or no larger than a seat.
bool isSeat(const LooseSurface& surface, const PlaneRegion& r) {
  if (r.middle.z() > bounds::kLowTable_m) return false;
  if (r.area_m2 < 0.3) return true;
  CellRaster footprint(bounds::kCell_m);
  for (int i : r.samples) {
    for (int dx = -2; dx <= 2; ++dx) {
      for (int dy = -2; dy <= 2; ++dy)
        footprint.set(surface.samples.at(i).head<2>() + bounds::kCell_m * Eigen::Vector2d(dx, dy));
    }
  }
  std::size_t above = 0;
  for (std::size_t i = 0; i < surface.samples.size(); ++i) {
    const Eigen::Vector3f& p = surface.samples.points[i];
    if (!surface.free[i] || static_cast<double>(p.z()) < r.middle.z() + 0.1 || p.z() > 1.4F) continue;
    above += footprint.has(footprint.index(static_cast<double>(p.x())), footprint.index(static_cast<double>(p.y())));
  }
  return above > r.samples.size() / 10;
}

/// Things on a table hide parts of its top.
bool isWithinRim(const TableTop& top, const Eigen::Vector3d& p) {
  const Eigen::Vector3d q = top.rim.toBox(p);
  const Eigen::Vector2d outside = (top.rim.box.min() - q).cwiseMax(q - top.rim.box.max()).head<2>();
  return outside.maxCoeff() < 0.03;
}

/// A table's rim has little surface below it; a cabinet's has its sides, of which a scan sees two at least.
bool hollowBelow(const LooseSurface& surface, const PlaneRegion& top) {
  const UprightBox rim = fitBox(surface.samples, top.samples, {surface.room.yaw_rad, surface.yawIn(top.samples)},
                                surface.toleranceOf(top.samples));
  const double high = top.middle.z() - 0.1, low = std::min(0.1, 0.3 * high);
  CellRaster sides(bounds::kCell_m);
  const Eigen::Vector3d sizes = rim.box.sizes();
  if (std::min(sizes.x(), sizes.y()) < 0.3) return false;  // a back's upper side, a sill
  for (std::size_t i = 0; i < surface.samples.size(); ++i) {
    if (!surface.free[i]) continue;
    const Eigen::Vector3d p = rim.toBox(surface.samples.at(static_cast<int>(i)));
    if (p.z() < low || p.z() > high) continue;
    const Eigen::Vector2d to_low = (p - rim.box.min()).head<2>(), to_high = (rim.box.max() - p).head<2>();
    const double inside = std::min(to_low.minCoeff(), to_high.minCoeff());
    if (inside < -0.06 || inside > 0.06) continue;
    // The rim unrolled.
    const bool along_x =
        std::min(std::abs(to_low.y()), std::abs(to_high.y())) < std::min(std::abs(to_low.x()), std::abs(to_high.x()));
    const double upper = along_x ? (to_high.y() < to_low.y() ? 100 : 0) : (to_high.x() < to_low.x() ? 300 : 200);
    sides.set({upper + (along_x ? p.x() - rim.box.min().x() : p.y() - rim.box.min().y()), p.z()});
  }
  const double around = 2 * (sizes.x() + sizes.y()) * (high - low);
  return sides.area_m2() < 0.33 * around;
}

}  // namespace

std::vector<TableTop> tableTops(const LooseSurface& surface, std::vector<int>& top_of) {
  std::vector<TableTop> tops;
  top_of.assign(surface.samples.size(), -1);
  for (const PlaneRegion& r : surface.regions) {
    if (std::abs(r.normal.z()) < 0.9999 || r.area_m2 < 0.15 || r.middle.z() < bounds::kTop_m[0] ||
        r.middle.z() > bounds::kTop_m[1])
      continue;
    if (surface.samples.oriented && r.normal.z() < 0) continue;
    std::size_t free = 0;
    for (int i : r.samples) free += surface.free[static_cast<std::size_t>(i)] != 0;
    if (2 * free < r.samples.size() || isSeat(surface, r) || !hollowBelow(surface, r)) continue;
    TableTop top{r.middle.z(),
                 CellRaster(bounds::kCell_m),
                 {},
                 fitBox(surface.samples, r.samples, {surface.room.yaw_rad, surface.yawIn(r.samples)},
                        surface.toleranceOf(r.samples))};
    for (int i : r.samples) {
      const Eigen::Vector2d p = surface.samples.at(i).head<2>();
      for (int dx = -1; dx <= 1; ++dx) {
        for (int dy = -1; dy <= 1; ++dy) top.footprint.set(p + bounds::kCell_m * Eigen::Vector2d(dx, dy));
      }
    }
    const int id = static_cast<int>(tops.size());
    const double above_m = std::max(surface.toleranceOf(r.samples), 0.02);
    for (std::size_t i = 0; i < surface.samples.size(); ++i) {
      const Eigen::Vector3d p = surface.samples.at(static_cast<int>(i));
      if (!surface.free[i] || top_of[i] >= 0 || p.z() > top.height_m + above_m || p.z() < top.height_m - 0.06) continue;
      if (!top.covers(p) && !isWithinRim(top, p)) continue;
      top_of[i] = id;
      top.samples.push_back(static_cast<int>(i));
    }
    if (static_cast<double>(top.samples.size()) * surface.samples.area_m2() > 0.1) {
      tops.push_back(std::move(top));
    } else {
      for (int i : top.samples) top_of[static_cast<std::size_t>(i)] = -1;
    }
  }
  return tops;
}

}  // namespace mmradartwin
