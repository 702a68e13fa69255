#include "scan/things/loose_surface.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

bool holds(const std::vector<Eigen::Vector2d>& loop, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0, k = loop.size() - 1; i < loop.size(); k = i++) {
    const Eigen::Vector2d &a = loop[i], &b = loop[k];
    if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x())
      inside = !inside;
  }
  return inside;
}

bool nearPlane(const LooseSurface& surface, int i) {
  const Eigen::Vector3d p = surface.samples.at(i);
  int corner = 0;  // planes within the reach of rounding
  for (const ScanPlane& plane : surface.room.planes) {
    const double reach_m = std::max(1.5 * planeTolerance(surface.samples, i, plane.normal), 0.02);
    const double d = std::abs(plane.normal.dot(p) - plane.offset_m);
    if (d > 3 * reach_m) continue;
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& q : plane.outline) box.extend(q);
    const Eigen::Vector2d q(plane.u.dot(p), plane.v.dot(p));
    if (box.exteriorDistance(q) > reach_m) continue;
    if (d < reach_m) return true;
    ++corner;
  }
  return corner > 1;
}

/// A carpet or a board is a flat part of its own, however near it lies to the plane behind it.
bool isOnLargePlate(const LooseSurface& surface, int i) {
  const int r = surface.region_of[static_cast<std::size_t>(i)];
  return r >= 0 && surface.regions[static_cast<std::size_t>(r)].area_m2 > 0.3;
}

}  // namespace

double LooseSurface::toleranceOf(const std::vector<int>& indices) const {
  if (samples.error_m.empty() || indices.empty()) return planeTolerance(samples);
  double sum = 0;
  for (int i : indices) sum += static_cast<double>(samples.error_m[static_cast<std::size_t>(i)].norm());
  return 3 * sum / static_cast<double>(indices.size());
}

double LooseSurface::yawIn(const std::vector<int>& indices) const {
  std::map<int, std::size_t> counts;
  double sum_sin = 0, sum_cos = 0;
  for (int i : indices) {
    const int r = region_of[static_cast<std::size_t>(i)];
    const Eigen::Vector3f& n = samples.normals[static_cast<std::size_t>(i)];
    if (std::abs(n.z()) > bounds::kUprightNormal) continue;
    const double angle = 4 * std::atan2(static_cast<double>(n.y()), static_cast<double>(n.x()));
    sum_sin += std::sin(angle), sum_cos += std::cos(angle);
    if (r >= 0 && std::abs(regions[static_cast<std::size_t>(r)].normal.z()) < bounds::kUprightPlane) ++counts[r];
  }
  int largest = -1;
  for (const auto& [r, count] : counts) {
    if (count > 40 && (largest < 0 || count > counts[largest])) largest = r;
  }
  if (largest >= 0) {
    const Eigen::Vector3d& n = regions[static_cast<std::size_t>(largest)].normal;
    return std::atan2(n.y(), n.x());
  }
  return std::hypot(sum_sin, sum_cos) > 0 ? 0.25 * std::atan2(sum_sin, sum_cos) : room.yaw_rad;
}

std::vector<std::vector<int>> LooseSurface::connected(const std::vector<int>& indices) const {
  std::vector<std::vector<int>> found;
  std::vector<char> open(samples.size(), 0);
  for (int i : indices) open[static_cast<std::size_t>(i)] = 1;
  const auto touching_m =
      static_cast<float>(std::min(bounds::kTouching_voxels * samples.spacing_m, bounds::kTouching_m));
  for (int start : indices) {
    if (!open[static_cast<std::size_t>(start)]) continue;
    open[static_cast<std::size_t>(start)] = 0;
    std::vector<int> queue = {start};
    for (std::size_t q = 0; q < queue.size(); ++q) {
      const auto i = static_cast<std::size_t>(queue[q]);
      for (std::size_t k = samples.first[i]; k < samples.first[i + 1]; ++k) {
        const auto j = static_cast<std::size_t>(samples.neighbour[k]);
        if (!open[j]) continue;
        if ((samples.points[i] - samples.points[j]).squaredNorm() > touching_m * touching_m) continue;
        open[j] = 0;
        queue.push_back(static_cast<int>(j));
      }
    }
    std::sort(queue.begin(), queue.end());
    found.push_back(std::move(queue));
  }
  return found;
}

LooseSurface looseSurface(const ScanSamples& samples, const std::vector<PlaneRegion>& regions, const RoomPlanes& room) {
  LooseSurface surface{samples, regions, room};
  surface.region_of.assign(samples.size(), -1);
  for (std::size_t r = 0; r < regions.size(); ++r) {
    for (int i : regions[r].samples) surface.region_of[static_cast<std::size_t>(i)] = static_cast<int>(r);
  }
  surface.free.assign(surface.samples.size(), 0);
  std::vector<std::vector<Eigen::Vector2d>> floors;
  const ScanPlane* floor = nullptr;
  for (const ScanPlane& p : surface.room.planes) {
    if (p.kind == PlaneKind::kFloor) floors.push_back(p.outline), floor = &p;
  }
  for (std::size_t i = 0; i < surface.samples.size(); ++i) {
    if (surface.room.owner[i] != -1) continue;
    const Eigen::Vector3d p = surface.samples.at(static_cast<int>(i));
    const double tolerance_m = planeTolerance(samples, static_cast<int>(i), Eigen::Vector3d::UnitZ());
    bool inside = p.z() > -tolerance_m && p.z() < surface.room.height_m + tolerance_m;
    if (inside && floor) {
      const Eigen::Vector2d q(floor->u.dot(p), floor->v.dot(p));
      inside = std::any_of(floors.begin(), floors.end(), [&q](const auto& loop) { return holds(loop, q); });
    }
    if (inside)
      surface.free[i] = !nearPlane(surface, static_cast<int>(i)) || isOnLargePlate(surface, static_cast<int>(i));
  }
  return surface;
}

}  // namespace mmradartwin
