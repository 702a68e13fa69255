#include "scan/planes/plane_groups.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "scan/planes/slanted_bounds.h"
#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

bool isUpright(const PlaneRegion& r) { return std::abs(r.normal.z()) < 1e-9; }

class PlaneGrouping {
 public:
  explicit PlaneGrouping(RoomParts& room) : room_(room) {}

  void group(const std::vector<PlaneRegion>& regions) {
    for (const PlaneRegion& r : regions) {
      if (!isUpright(r) && !isLevel(r)) continue;
      PlaneGroup* home = nullptr;
      bool doubled = false;
      for (PlaneGroup& g : room_.groups) {
        if (g.plane.normal.dot(r.normal) < 1 - 1e-9) continue;
        const double apart = std::abs(g.plane.offset_m - r.offset_m);
        if (apart < std::max(planeTolerance(room_.samples, r), 3 * std::hypot(g.plane.offset_std_m, r.offset_std_m))) {
          home = &g;
          break;
        }
        if (apart < bounds::kSameSurface_m && overlap(room_.samples, g, r) > 0.5) {
          home = &g, doubled = true;
          break;
        }
      }
      if (!home) {
        room_.groups.emplace_back();
        room_.groups.back().plane = r;
        setAxes(room_.groups.back());
      } else if (doubled) {
        home->second_copy.insert(home->second_copy.end(), r.samples.begin(), r.samples.end());
        // What covers little of a wall is no copy of it but stragglers, or a thin thing on it.
        if (r.area_m2 > bounds::kLeastCopy * home->plane.area_m2) addCopy(r, *home);
      } else if (home->copies) {
        addCopy(r, *home);
      } else {
        home->plane.samples.insert(home->plane.samples.end(), r.samples.begin(), r.samples.end());
        fitOffset(room_.samples, home->plane);
      }
    }
    for (PlaneGroup& g : room_.groups) {
      std::sort(g.plane.samples.begin(), g.plane.samples.end());
      if (!g.copies) fitOffset(room_.samples, g.plane);
      measurePlane(room_.samples, g.plane);
    }
  }

  /// Copies of one surface are measurements of it from several places, none of them known better than the others: the
  /// surface is their mean.
  static void addCopy(const PlaneRegion& r, PlaneGroup& g) {
    const double own = static_cast<double>(g.plane.samples.size()), added = static_cast<double>(r.samples.size());
    g.plane.offset_m = (own * g.plane.offset_m + added * r.offset_m) / (own + added);
    g.plane.samples.insert(g.plane.samples.end(), r.samples.begin(), r.samples.end());
    g.copies = true;
  }

  void shift(const std::vector<PlaneShift>& shifts) {
    for (const PlaneShift& s : shifts) room_.groups.at(s.plane).plane.offset_m += s.by_m;
  }

  static void setAxes(PlaneGroup& g) {
    if (isLevel(g.plane)) {
      g.u = Eigen::Vector3d::UnitX();
      g.v = g.plane.normal.cross(g.u);
    } else {
      g.u = Eigen::Vector3d::UnitZ().cross(g.plane.normal);
      g.v = Eigen::Vector3d::UnitZ();
    }
  }

  void findWalls() {
    for (PlaneGroup& g : room_.groups) {
      if (!isUpright(g.plane)) continue;
      std::vector<double> heights;
      for (int i : g.plane.samples) heights.push_back(room_.samples.at(i).z());
      std::sort(heights.begin(), heights.end());
      g.low_m = heights[heights.size() / 50];
      g.high_m = heights[heights.size() - 1 - heights.size() / 50];
      const double height = g.high_m - g.low_m;
      const double top = room_.frame.has_ceiling ? room_.height_m - bounds::kBelowTop_m
                                                 : std::min(bounds::kLowWall_m, room_.height_m - 0.4);
      g.wall = g.plane.area_m2 > 0.5 && g.high_m > top && height > 0.4 * room_.height_m && !isPillar(g);
    }
    // Nothing is seen behind an outer wall, however little of it furniture leaves to see; what lies on a wall is none.
    for (PlaneGroup& g : room_.groups) {
      if (!isUpright(g.plane) || g.wall || g.plane.area_m2 < 0.5) continue;
      if ((g.high_m < 1.5 || g.high_m - g.low_m < 1.2) && !endsAtSlant(room_, g)) continue;
      const bool on_wall = std::any_of(room_.groups.begin(), room_.groups.end(), [&g](const PlaneGroup& w) {
        return w.wall && w.plane.normal.dot(g.plane.normal) > 0.99 && std::abs(w.plane.distance(g.plane.middle)) < 0.3;
      });
      g.wall = !on_wall && seenBehind(g) < bounds::kSeenBehind;
    }
  }

  /// Samples behind a plane, within its ends, as a share of its own.
  double seenBehind(const PlaneGroup& g) const {
    double low = 1e9, high = -1e9;
    for (int i : g.plane.samples)
      low = std::min(low, g.u.dot(room_.samples.at(i))), high = std::max(high, g.u.dot(room_.samples.at(i)));
    std::size_t count = 0;
    for (const Eigen::Vector3f& q : room_.samples.points) {
      const Eigen::Vector3d p = q.cast<double>();
      const double u = g.u.dot(p), d = g.plane.distance(p);
      count += u > low && u < high && d < -bounds::kBehind_m[0] && d > -bounds::kBehind_m[1] && p.z() > 0.1 &&
               p.z() < room_.height_m - 0.1;
    }
    return static_cast<double>(count) / static_cast<double>(g.plane.samples.size());
  }

  /// Share of all samples behind a plane.
  double behind(const PlaneGroup& g) const {
    std::size_t count = 0;
    for (const Eigen::Vector3f& p : room_.samples.points) count += g.plane.distance(p.cast<double>()) < -0.1;
    return static_cast<double>(count) / static_cast<double>(room_.samples.size());
  }

  /// A narrow upright plane that others of its kind close to a column: the room goes on behind it.
  bool isPillar(const PlaneGroup& g) const {
    double low = 1e9, high = -1e9;
    for (int i : g.plane.samples) {
      const double u = g.u.dot(room_.samples.at(i));
      low = std::min(low, u), high = std::max(high, u);
    }
    if (high - low > bounds::kPillar_m) return false;
    // Both ends are convex: nothing of the scan stands before the plane there, and the room is seen behind.
    std::size_t before = 0, beyond = 0;
    for (const Eigen::Vector3f& q : room_.samples.points) {
      const Eigen::Vector3d p = q.cast<double>();
      if (p.z() < 0.3 || p.z() > room_.height_m - bounds::kBelowTop_m) continue;
      const double u = g.u.dot(p), d = g.plane.distance(p);
      if (u > low - 0.3 && u < high + 0.3 && d > 0.1 && d < 0.5) ++before;
      if (u > low - 0.1 && u < high + 0.1 && d < -0.1 && d > -1.2) ++beyond;
    }
    return before < g.plane.samples.size() / 4 && beyond > 0 && behind(g) > 0.05;
  }

  RoomParts& room_;
};

}  // namespace

bool isLevel(const PlaneRegion& region) { return std::abs(region.normal.z()) > 1 - 1e-12; }

Eigen::Vector2d RoomParts::inMain(const Eigen::Vector3d& p) const {
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  return {c * p.x() + s * p.y(), -s * p.x() + c * p.y()};
}

bool endsAtSlant(const RoomParts& room, const PlaneGroup& g) {
  return std::any_of(room.slants.begin(), room.slants.end(), [&g](const PlaneRegion& slant) {
    const Eigen::Vector3d top(g.plane.middle.x(), g.plane.middle.y(), g.high_m);
    return std::abs(slant.distance(top)) < bounds::kSnap_m && slant.normal.dot(g.plane.normal) > 0;
  });
}

double overlap(const ScanSamples& samples, const PlaneGroup& g, const PlaneRegion& r) {
  std::set<std::pair<int, int>> cells, both;
  const auto cell = [&g](const Eigen::Vector3d& p) {
    const Eigen::Vector2d q = g.project(p) / (2 * bounds::kCell_m);
    return std::make_pair(static_cast<int>(std::floor(q.x())), static_cast<int>(std::floor(q.y())));
  };
  for (int i : r.samples) cells.insert(cell(samples.at(i)));
  for (int i : g.plane.samples) {
    const auto at = cell(samples.at(i));
    if (cells.count(at)) both.insert(at);
  }
  return cells.empty() ? 0 : static_cast<double>(both.size()) / static_cast<double>(cells.size());
}

RoomParts roomParts(const ScanFrame& frame, const ScanSamples& samples, const std::vector<PlaneRegion>& regions,
                    double yaw_rad, const std::vector<PlaneShift>& shifts) {
  RoomParts room{frame, samples, yaw_rad, 0, {}, {}};
  std::vector<float> heights;
  for (const Eigen::Vector3f& p : samples.points) heights.push_back(p.z());
  std::sort(heights.begin(), heights.end());
  room.height_m = frame.has_ceiling ? frame.ceiling_m : static_cast<double>(heights[heights.size() * 199 / 200]);
  PlaneGrouping grouping(room);
  grouping.group(regions);
  grouping.shift(shifts);
  room.slants = slantedBounds(samples, regions, room.height_m);
  grouping.findWalls();
  return room;
}

}  // namespace mmradartwin
