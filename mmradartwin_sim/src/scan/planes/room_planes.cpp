#include "scan/planes/room_planes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>
#include <numeric>
#include <set>

#include "mmradartwin_dsp/input_error.h"
#include "scan/planes/floor_cells.h"
#include "scan/planes/polygon_triangles.h"
#include "scan/planes/slanted_bounds.h"
#include "scan/samples/cell_raster.h"
#include "scene/polygon_set.h"

namespace mmradartwin {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kSameWall_m = 0.045;  // a wall that drift has doubled is one; boards hang farther off
constexpr double kSnap_m = 0.25;       // corners are rounded, hidden or not scanned so far
constexpr double kBridge_m = 0.6;      // a gap in a wall's columns, of a curtain or a tall cabinet
constexpr double kLeastHole_m = 0.35, kLeastHole_m2 = 0.2;  // smaller gaps are where a scan has none
constexpr double kHides_m = 1.2;                            // what stands so far before a wall may hide it
constexpr double kCell_m = 0.05;
constexpr double kOpenStep_m = 1.0;
constexpr double kLeastSeen_m2 = 0.2;  // of a wall
constexpr double kParallel = 0.98;     // cosine of 11 deg
constexpr double kStraggler = 0.7;     // cosine between a straggler's normal and its plane's

std::string text(const char* format, double a, double b = 0) {
  std::array<char, 200> line{};
  std::snprintf(line.data(), line.size(), format, a, b);
  return line.data();
}

Eigen::Vector3d sampleAt(const ScanSamples& samples, int i) {
  return samples.points[static_cast<std::size_t>(i)].cast<double>();
}

bool isUpright(const PlaneRegion& r) { return std::abs(r.normal.z()) < 1e-9; }
bool isLevel(const PlaneRegion& r) { return std::abs(r.normal.z()) > 1 - 1e-12; }

/// Upright or level parts of one plane, wherever they are.
struct PlaneGroup {
  PlaneRegion plane;
  std::vector<int> second_copy;  // samples of what drift has doubled
  Eigen::Vector3d u = Eigen::Vector3d::UnitX(), v = Eigen::Vector3d::UnitY();
  double low_m = 0, high_m = 0;  // of an upright plane: heights of its samples
  bool wall = false;

  Eigen::Vector2d project(const Eigen::Vector3d& p) const { return {u.dot(p), v.dot(p)}; }
};

/// A wall from one end to the other.
struct WallRun {
  std::size_t group;
  double from_m, to_m;
  double top_m = 0;
  std::vector<Eigen::AlignedBox2d> openings = {};
};

class RoomBuilder {
 public:
  RoomBuilder(const std::string& file, const ScanFrame& frame, const ScanSamples& samples,
              const std::vector<PlaneRegion>& regions, double yaw_rad, const std::vector<PlaneShift>& shifts)
      : file_(file), frame_(frame), samples_(samples), tolerance_m_(planeTolerance(samples)) {
    room_.yaw_rad = yaw_rad;
    room_.owner.assign(samples.size(), -1);
    std::vector<float> heights;
    for (const Eigen::Vector3f& p : samples.points) heights.push_back(p.z());
    std::sort(heights.begin(), heights.end());
    room_.height_m = frame.has_ceiling ? frame.ceiling_m : static_cast<double>(heights[heights.size() * 199 / 200]);
    group(regions);
    shift(shifts);
    slants_ = slantedBounds(samples, regions, room_.height_m);
    findWalls();
  }

  RoomPlanes run() {
    std::vector<WallRun> runs;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      if (groups_[g].wall) addRuns(g, runs);
    }
    if (runs.empty())
      throw InputError(file_ + ": shows no wall, so that it is no room; outdoors and tables alone are no scenes");
    for (WallRun& run : runs) {
      const PlaneGroup& g = groups_[run.group];
      const bool to_top = frame_.has_ceiling || g.high_m > room_.height_m - 0.3 || endsAtSlant(g);
      run.top_m = to_top ? room_.height_m : g.high_m;
      run.openings = openings(g, run, run.top_m);
    }
    addFloorAndCeiling(runs);
    for (const WallRun& run : runs) addWall(run);
    if (walls_ == 0) throw InputError(file_ + ": shows no wall around its floor, so that it is no room");
    return std::move(room_);
  }

 private:
  void group(const std::vector<PlaneRegion>& regions) {
    for (const PlaneRegion& r : regions) {
      if (!isUpright(r) && !isLevel(r)) continue;
      PlaneGroup* home = nullptr;
      bool doubled = false;
      for (PlaneGroup& g : groups_) {
        if (g.plane.normal.dot(r.normal) < 1 - 1e-9) continue;
        const double apart = std::abs(g.plane.offset_m - r.offset_m);
        if (apart < std::max(tolerance_m_, 3 * std::hypot(g.plane.offset_std_m, r.offset_std_m))) {
          home = &g;
          break;
        }
        if (apart < kSameWall_m && overlap(g, r) > 0.5) {
          home = &g, doubled = true;
          break;
        }
      }
      if (!home) {
        groups_.emplace_back();
        groups_.back().plane = r;
        setAxes(groups_.back());
      } else if (doubled) {
        home->second_copy.insert(home->second_copy.end(), r.samples.begin(), r.samples.end());
      } else {
        home->plane.samples.insert(home->plane.samples.end(), r.samples.begin(), r.samples.end());
        fitOffset(samples_, home->plane);
      }
    }
    for (PlaneGroup& g : groups_) {
      std::sort(g.plane.samples.begin(), g.plane.samples.end());
      fitOffset(samples_, g.plane);
      measurePlane(samples_, g.plane);
    }
  }

  void shift(const std::vector<PlaneShift>& shifts) {
    for (const PlaneShift& s : shifts) groups_.at(s.plane).plane.offset_m += s.by_m;
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

  /// Share of a region's area over which a group's plane has samples, too.
  double overlap(const PlaneGroup& g, const PlaneRegion& r) const {
    std::set<std::pair<int, int>> cells, both;
    const auto cell = [&g](const Eigen::Vector3d& p) {
      const Eigen::Vector2d q = g.project(p) / (2 * kCell_m);
      return std::make_pair(static_cast<int>(std::floor(q.x())), static_cast<int>(std::floor(q.y())));
    };
    for (int i : r.samples) cells.insert(cell(sampleAt(samples_, i)));
    for (int i : g.plane.samples) {
      const auto at = cell(sampleAt(samples_, i));
      if (cells.count(at)) both.insert(at);
    }
    return cells.empty() ? 0 : static_cast<double>(both.size()) / static_cast<double>(cells.size());
  }

  void findWalls() {
    for (PlaneGroup& g : groups_) {
      if (!isUpright(g.plane)) continue;
      std::vector<double> heights;
      for (int i : g.plane.samples) heights.push_back(sampleAt(samples_, i).z());
      std::sort(heights.begin(), heights.end());
      g.low_m = heights[heights.size() / 50];
      g.high_m = heights[heights.size() - 1 - heights.size() / 50];
      const double height = g.high_m - g.low_m;
      const double top = frame_.has_ceiling ? room_.height_m - 0.3 : std::min(1.9, room_.height_m - 0.4);
      g.wall = g.plane.area_m2 > 0.5 && g.high_m > top && height > 0.4 * room_.height_m && !isPillar(g);
    }
    // Nothing is seen behind an outer wall, however little of it furniture leaves to see; what lies on a wall is none.
    for (PlaneGroup& g : groups_) {
      if (!isUpright(g.plane) || g.wall || g.plane.area_m2 < 0.5) continue;
      if ((g.high_m < 1.5 || g.high_m - g.low_m < 1.2) && !endsAtSlant(g)) continue;
      const bool on_wall = std::any_of(groups_.begin(), groups_.end(), [&g](const PlaneGroup& w) {
        return w.wall && w.plane.normal.dot(g.plane.normal) > 0.99 && std::abs(w.plane.distance(g.plane.middle)) < 0.3;
      });
      g.wall = !on_wall && seenBehind(g) < 0.1;
    }
  }

  /// A low wall ends where a slanted plane meets it.
  bool endsAtSlant(const PlaneGroup& g) const {
    return std::any_of(slants_.begin(), slants_.end(), [&g](const PlaneRegion& slant) {
      const Eigen::Vector3d top(g.plane.middle.x(), g.plane.middle.y(), g.high_m);
      return std::abs(slant.distance(top)) < kSnap_m && slant.normal.dot(g.plane.normal) > 0;
    });
  }

  /// Samples behind a plane, within its ends, as a share of its own.
  double seenBehind(const PlaneGroup& g) const {
    double low = 1e9, high = -1e9;
    for (int i : g.plane.samples)
      low = std::min(low, g.u.dot(sampleAt(samples_, i))), high = std::max(high, g.u.dot(sampleAt(samples_, i)));
    std::size_t count = 0;
    for (const Eigen::Vector3f& q : samples_.points) {
      const Eigen::Vector3d p = q.cast<double>();
      const double u = g.u.dot(p), d = g.plane.distance(p);
      count += u > low && u < high && d < -0.15 && d > -3 && p.z() > 0.1 && p.z() < room_.height_m - 0.1;
    }
    return static_cast<double>(count) / static_cast<double>(g.plane.samples.size());
  }

  /// Share of all samples behind a plane.
  double behind(const PlaneGroup& g) const {
    std::size_t count = 0;
    for (const Eigen::Vector3f& p : samples_.points) count += g.plane.distance(p.cast<double>()) < -0.1;
    return static_cast<double>(count) / static_cast<double>(samples_.size());
  }

  /// A narrow upright plane that others of its kind close to a column: the room goes on behind it.
  bool isPillar(const PlaneGroup& g) const {
    double low = 1e9, high = -1e9;
    for (int i : g.plane.samples) {
      const double u = g.u.dot(sampleAt(samples_, i));
      low = std::min(low, u), high = std::max(high, u);
    }
    if (high - low > 1.2) return false;
    // Both ends are convex: nothing of the scan stands before the plane there, and the room is seen behind.
    std::size_t before = 0, beyond = 0;
    for (const Eigen::Vector3f& q : samples_.points) {
      const Eigen::Vector3d p = q.cast<double>();
      if (p.z() < 0.3 || p.z() > room_.height_m - 0.3) continue;
      const double u = g.u.dot(p), d = g.plane.distance(p);
      if (u > low - 0.3 && u < high + 0.3 && d > 0.1 && d < 0.5) ++before;
      if (u > low - 0.1 && u < high + 0.1 && d < -0.1 && d > -1.2) ++beyond;
    }
    return before < g.plane.samples.size() / 4 && beyond > 0 && behind(g) > 0.05;
  }

  /// Where other walls cross a wall, as places along it; only where the other wall reaches it.
  std::vector<double> crossings(std::size_t g) const {
    std::vector<double> places;
    const PlaneGroup& wall = groups_[g];
    for (std::size_t o = 0; o < groups_.size(); ++o) {
      const PlaneGroup& other = groups_[o];
      if (o == g || !other.wall || std::abs(other.plane.normal.dot(wall.plane.normal)) > 0.9) continue;
      // p on both planes: p = offset n + s u with other.n . p = other.offset.
      const double slope = other.plane.normal.dot(wall.u);
      const double s = (other.plane.offset_m - wall.plane.offset_m * other.plane.normal.dot(wall.plane.normal)) / slope;
      std::size_t near = 0;
      for (int i : other.plane.samples) near += std::abs(wall.plane.distance(sampleAt(samples_, i))) < kSnap_m + 0.15;
      if (static_cast<double>(near) * samples_.area_m2() > 0.05) places.push_back(s);
    }
    std::sort(places.begin(), places.end());
    return places;
  }

  void addRuns(std::size_t g, std::vector<WallRun>& runs) const {
    const PlaneGroup& wall = groups_[g];
    std::map<int, std::set<int>> columns;
    for (int i : wall.plane.samples) {
      const Eigen::Vector2d p = wall.project(sampleAt(samples_, i)) / kCell_m;
      columns[static_cast<int>(std::floor(p.x()))].insert(static_cast<int>(std::floor(p.y())));
    }
    const std::vector<double> places = crossings(g);
    const auto snapped = [&places](double at) {
      double best = at, least = kSnap_m;
      for (double s : places) {
        if (std::abs(s - at) < least) least = std::abs(s - at), best = s;
      }
      return best;
    };
    std::vector<WallRun> found;
    for (const auto& [column, rows] : columns) {
      if (static_cast<double>(rows.size()) * kCell_m < 0.12 * room_.height_m) continue;
      const double from = column * kCell_m, to = from + kCell_m;
      const bool crossed = !found.empty() && std::any_of(places.begin(), places.end(), [&](double s) {
        return s > found.back().to_m - 0.02 && s < from + 0.02 && from - found.back().to_m > 0.1;
      });
      if (!found.empty() && from - found.back().to_m < kBridge_m && !crossed) {
        found.back().to_m = to;
      } else {
        found.push_back({g, from, to, 0, {}});
      }
    }
    for (WallRun& run : found) {
      run.from_m = snapped(run.from_m), run.to_m = snapped(run.to_m);
      if (run.to_m - run.from_m > 0.3) runs.push_back(run);
    }
  }

  Eigen::Vector2d inMain(const Eigen::Vector3d& p) const {
    const double c = std::cos(room_.yaw_rad), s = std::sin(room_.yaw_rad);
    return {c * p.x() + s * p.y(), -s * p.x() + c * p.y()};
  }
  std::array<Eigen::Vector2d, 2> endsOf(const WallRun& run) const {
    const PlaneGroup& g = groups_[run.group];
    const Eigen::Vector3d foot = g.plane.offset_m * g.plane.normal;
    return {inMain(foot + run.from_m * g.u), inMain(foot + run.to_m * g.u)};
  }

  /// The floor reaches to the walls: of the cells that the walls' lines cut the plane into, those that hold the scan
  /// and that no wall parts from the largest. Walls that do not face these are those of a mirror's room, or seen
  /// through a window.
  void addFloorAndCeiling(std::vector<WallRun>& runs) {
    FloorCells cells = cutFloor(runs);
    const std::size_t columns = cells.xs.size() - 1, rows = cells.ys.size() - 1;
    CellRaster scanned(2 * kCell_m);
    for (const Eigen::Vector3f& p : samples_.points) {
      if (p.z() > -0.3F && p.z() < static_cast<float>(room_.height_m) + 0.3F) scanned.set(inMain(p.cast<double>()));
    }
    std::vector<double> share(columns * rows);
    std::size_t start = 0;
    double most = -1;
    for (std::size_t i = 0; i < columns; ++i) {
      for (std::size_t k = 0; k < rows; ++k) {
        const std::size_t c = cells.index(i, k);
        share[c] = scanned.share(cells.box(i, k));
        const double area = share[c] * cells.box(i, k).volume();
        if (area > most) most = area, start = c;
      }
    }
    const auto is_walled = [&](std::size_t i, std::size_t k, const CellStep& step) {
      return walled(runs, cells, i, k, step);
    };
    fillFrom(start, share, is_walled, cells);
    fillNooks(is_walled, cells);
    PlaneLoops loops = {{{cells.xs.front(), cells.ys.front()},
                         {cells.xs.back(), cells.ys.front()},
                         {cells.xs.back(), cells.ys.back()},
                         {cells.xs.front(), cells.ys.back()}}};
    for (std::size_t i = 0; i < columns; ++i) {
      for (std::size_t k = 0; k < rows; ++k) {
        if (!cells.inside[cells.index(i, k)]) loops = without(loops, {loopOf(cells.box(i, k))});
      }
    }
    std::vector<WallRun> facing;
    std::copy_if(runs.begin(), runs.end(), std::back_inserter(facing),
                 [&](const WallRun& run) { return facesRoom(run, cells); });
    const std::size_t before = runs.size();
    // One frame of a camera may show walls apart from all floor.
    if (!facing.empty()) runs = facing;
    if (before > runs.size())
      room_.notes.push_back(
          text("%.0f upright plane(s) outside of the room were left out", static_cast<double>(before - runs.size())));
    loops = withoutCorners(runs, scanned, loops);
    const Eigen::Vector2d ex(std::cos(room_.yaw_rad), std::sin(room_.yaw_rad));
    addLevel("floor", PlaneKind::kFloor, 1, 0, belowSlants(loops, 0), ex);
    if (frame_.has_ceiling)
      addLevel("ceiling", PlaneKind::kCeiling, -1, frame_.ceiling_m, belowSlants(loops, frame_.ceiling_m), ex);
    for (std::size_t i = 0; i < slants_.size(); ++i) addSlant(i, loops);
  }

  /// Axes of the main directions at a height.
  PlaneAxes mainAxes(double height_m) const {
    const double c = std::cos(room_.yaw_rad), s = std::sin(room_.yaw_rad);
    return {height_m * Eigen::Vector3d::UnitZ(), {c, s, 0}, {-s, c, 0}};
  }
  static Eigen::AlignedBox2d boxOf(const PlaneLoops& loops) {
    Eigen::AlignedBox2d box;
    for (const auto& loop : loops) {
      for (const Eigen::Vector2d& p : loop) box.extend(p);
    }
    return box;
  }

  /// What of a level lies in the room, and not behind a slanted plane.
  PlaneLoops belowSlants(PlaneLoops loops, double height_m) const {
    for (const PlaneRegion& slant : slants_) {
      const PlaneLoops behind = behindSlant(slant, mainAxes(height_m), boxOf(loops));
      if (!behind.empty()) loops = without(loops, behind);
    }
    return loops;
  }

  /// Cells are rectangles along the main directions, so that they reach behind a wall that cuts a corner. What lies
  /// behind such a wall, as far as a right angle over it goes, is none of the room where the scan has nothing there.
  PlaneLoops withoutCorners(const std::vector<WallRun>& runs, const CellRaster& scanned, PlaneLoops loops) const {
    for (const WallRun& run : runs) {
      const auto [p, q] = endsOf(run);
      const Eigen::Vector2d along = q - p, n = inMain(groups_[run.group].plane.normal);
      if (std::abs(along.x()) < 1e-6 || std::abs(along.y()) < 1e-6) continue;
      const double depth_m = 0.5 * along.norm() + kSnap_m;
      std::size_t seen = 0, all = 0;
      for (double a = kCell_m; a < along.norm(); a += 2 * kCell_m) {
        for (double d = 4 * kCell_m; d < depth_m; d += 2 * kCell_m, ++all) {
          const Eigen::Vector2d at = p + a * along.normalized() - d * n;
          seen += scanned.has(scanned.index(at.x()), scanned.index(at.y()));
        }
      }
      // Of a wall that drift has doubled the outer copy ends the floor, so that no gap is left between them.
      const bool is_inner = std::any_of(runs.begin(), runs.end(), [&](const WallRun& other) {
        const double behind_m = (p - endsOf(other)[0]).dot(inMain(groups_[other.group].plane.normal));
        return n.dot(inMain(groups_[other.group].plane.normal)) > kParallel && behind_m > 1e-3 && behind_m < depth_m;
      });
      if (is_inner || 10 * seen > all) continue;
      // The wall's place is known to the tolerance: the floor ends behind it.
      const Eigen::Vector2d near = tolerance_m_ * n, far = depth_m * n;
      std::vector<Eigen::Vector2d> behind = {p - near, q - near, q - far, p - far};
      if (signedAreaOf(behind) < 0) std::reverse(behind.begin(), behind.end());
      loops = without(loops, {behind});
    }
    return loops;
  }

  /// The part of a slanted plane between floor and ceiling, over the floor and below the other slanted planes.
  void addSlant(std::size_t index, PlaneLoops loops) {
    PlaneGroup group;
    group.plane = slants_[index];
    group.u = Eigen::Vector3d::UnitZ().cross(group.plane.normal).normalized();
    group.v = group.plane.normal.cross(group.u);
    const PlaneRegion& slant = group.plane;
    // Over a place q of the main axes the slanted plane is at height(q), so that its points are affine in q.
    const PlaneAxes level = mainAxes(0);
    const auto lifted = [&slant](const Eigen::Vector3d& p) { return -slant.distance(p) / slant.normal.z(); };
    const double rise_u = -slant.normal.dot(level.u) / slant.normal.z();
    const double rise_v = -slant.normal.dot(level.v) / slant.normal.z();
    const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    const PlaneAxes on_slant{lifted(level.origin) * up, level.u + rise_u * up, level.v + rise_v * up};
    std::vector<PlaneRegion> limits(2);
    limits[0].normal = up, limits[0].offset_m = 0;
    limits[1].normal = -up, limits[1].offset_m = -room_.height_m;
    for (std::size_t i = 0; i < slants_.size(); ++i) {
      if (i != index) limits.push_back(slants_[i]);
    }
    for (const PlaneRegion& limit : limits) {
      const PlaneLoops behind = behindSlant(limit, on_slant, boxOf(loops));
      if (!behind.empty()) loops = without(loops, behind);
    }
    for (auto& loop : loops) {
      for (Eigen::Vector2d& q : loop) q = group.project(on_slant.origin + q.x() * on_slant.u + q.y() * on_slant.v);
      std::reverse(loop.begin(), loop.end());  // it is seen from below
    }
    addParts(group, PlaneKind::kCeiling, "roof_" + std::to_string(index + 1), loops);
  }

  static std::vector<Eigen::Vector2d> loopOf(const Eigen::AlignedBox2d& box) {
    return {box.min(), {box.max().x(), box.min().y()}, box.max(), {box.min().x(), box.max().y()}};
  }

  FloorCells cutFloor(const std::vector<WallRun>& runs) const {
    std::set<double> xs, ys;
    Eigen::AlignedBox2d box;
    for (int i : floorSamples()) box.extend(inMain(sampleAt(samples_, i)));
    std::vector<Eigen::Vector2d> slanted;
    for (const WallRun& run : runs) {
      const auto [p, q] = endsOf(run);
      if (std::abs(p.x() - q.x()) < 1e-6) {
        xs.insert(p.x());
      } else if (std::abs(p.y() - q.y()) < 1e-6) {
        ys.insert(p.y());
      } else {
        slanted.push_back(p), slanted.push_back(q);
      }
      box.extend(p), box.extend(q);
    }
    const auto add = [](std::set<double>& lines, double line, double apart) {
      if (std::none_of(lines.begin(), lines.end(), [&](double l) { return std::abs(l - line) < apart; }))
        lines.insert(line);
    };
    for (const Eigen::Vector2d& p : slanted) add(xs, p.x(), kSnap_m), add(ys, p.y(), kSnap_m);
    add(xs, box.min().x(), kSnap_m), add(xs, box.max().x(), kSnap_m);
    add(ys, box.min().y(), kSnap_m), add(ys, box.max().y(), kSnap_m);
    // Where no wall bounds the scan, the floor follows it by such steps.
    for (double x = box.min().x(); x < box.max().x(); x += kOpenStep_m) add(xs, x, kOpenStep_m / 2);
    for (double y = box.min().y(); y < box.max().y(); y += kOpenStep_m) add(ys, y, kOpenStep_m / 2);
    FloorCells cells;
    const auto distinct = [](const std::set<double>& lines) {
      std::vector<double> list;
      for (double l : lines) {
        if (list.empty() || l - list.back() > 1e-3) list.push_back(l);
      }
      return list;
    };
    cells.xs = distinct(xs), cells.ys = distinct(ys);
    return cells;
  }

  /// A wall without a doorway stands on most of a cell's edge.
  bool walled(const std::vector<WallRun>& runs, const FloorCells& cells, std::size_t i, std::size_t k,
              const CellStep& side) const {
    const bool across_x = side[0] != 0;
    const double line = across_x ? cells.xs[i + (side[0] > 0)] : cells.ys[k + (side[1] > 0)];
    const double low = across_x ? cells.ys[k] : cells.xs[i], high = across_x ? cells.ys[k + 1] : cells.xs[i + 1];
    double covered = 0;
    for (const WallRun& run : runs) {
      const auto [p, q] = endsOf(run);
      const double at = across_x ? p.x() : p.y(), other = across_x ? q.x() : q.y();
      if (std::abs(at - line) > 2e-3 || std::abs(other - line) > 2e-3) continue;
      const double from = across_x ? p.y() : p.x(), to = across_x ? q.y() : q.x();
      covered += std::max(0.0, std::min(high, std::max(from, to)) - std::max(low, std::min(from, to)));
      for (const Eigen::AlignedBox2d& hole : run.openings) {
        if (hole.min().y() > 0) continue;
        const double sign = to > from ? 1 : -1;
        const double a = from + sign * (hole.min().x() - run.from_m), b = from + sign * (hole.max().x() - run.from_m);
        if (std::min(a, b) < high && std::max(a, b) > low) return false;
      }
    }
    return covered > 0.5 * (high - low);
  }

  bool facesRoom(const WallRun& run, const FloorCells& cells) const {
    const auto [p, q] = endsOf(run);
    const PlaneGroup& g = groups_[run.group];
    const Eigen::Vector2d n = inMain(g.plane.normal);
    int inside = 0, behind = 0;
    for (int i = 0; i < 10; ++i) {
      const Eigen::Vector2d at = p + (i + 0.5) / 10 * (q - p);
      inside += cells.holds(at + 0.1 * n);
      behind += cells.holds(at - 0.25 * n);
    }
    // A low or narrow plane in the midst of the room is a partition, a cabinet's or a pillar's.
    if ((g.high_m < room_.height_m - 0.3 || run.to_m - run.from_m < 1.2) && behind > 3) return false;
    return inside >= 4;
  }

  std::vector<int> floorSamples() const {
    std::vector<int> all;
    for (const PlaneGroup& g : groups_) {
      if (isLevel(g.plane) &&
          (std::abs(g.plane.middle.z()) < kSameWall_m || std::abs(g.plane.middle.z() - room_.height_m) < kSameWall_m)) {
        all.insert(all.end(), g.plane.samples.begin(), g.plane.samples.end());
      }
    }
    return all;
  }

  void addLevel(const std::string& name, PlaneKind kind, int side, double height_m, const PlaneLoops& loops,
                const Eigen::Vector2d& ex) {
    // Samples of the level, of whichever part.
    PlaneGroup level;
    level.plane.normal = side * Eigen::Vector3d::UnitZ();
    level.plane.offset_m = side * height_m;
    level.u = {ex.x(), ex.y(), 0};
    level.v = level.plane.normal.cross(level.u);
    for (const PlaneGroup& g : groups_) {
      if (!isLevel(g.plane) || std::abs(g.plane.middle.z() - height_m) > kSameWall_m) continue;
      if (std::abs(g.plane.middle.z() - height_m) < tolerance_m_) {
        level.plane.samples.insert(level.plane.samples.end(), g.plane.samples.begin(), g.plane.samples.end());
      } else if (overlap(level, g.plane) > 0.5) {  // groups come largest first; a carpet hides the floor
        level.second_copy.insert(level.second_copy.end(), g.plane.samples.begin(), g.plane.samples.end());
      }
      level.second_copy.insert(level.second_copy.end(), g.second_copy.begin(), g.second_copy.end());
    }
    measurePlane(samples_, level.plane);
    std::size_t parts = 0;
    std::vector<std::vector<Eigen::Vector2d>> outlines, holes;
    for (const auto& loop : loops) (signedAreaOf(loop) > 0 ? outlines : holes).push_back(loop);
    parts = outlines.size();
    for (std::size_t i = 0; i < outlines.size(); ++i) {
      ScanPlane plane = planeOf(level, kind);
      plane.name = parts == 1 ? name : name + "_" + std::to_string(i + 1);
      // (x, y) of the main directions are (u, v) of the floor, (u, -v) of the ceiling.
      const auto flipped = [side](std::vector<Eigen::Vector2d> loop) {
        if (side < 0) {
          for (Eigen::Vector2d& p : loop) p.y() *= -1;
          std::reverse(loop.begin(), loop.end());
        }
        return loop;
      };
      plane.outline = flipped(outlines[i]);
      for (const auto& hole : holes) {
        if (parts == 1) plane.holes.push_back(flipped(hole));
      }
      finish(level, plane);
    }
  }

  void addWall(const WallRun& run) {
    const PlaneGroup& g = groups_[run.group];
    const double top = run.top_m;
    PlaneLoops loops = {{{run.from_m, 0}, {run.to_m, 0}, {run.to_m, top}, {run.from_m, top}}};
    for (const Eigen::AlignedBox2d& hole : run.openings) loops = without(loops, {loopOf(hole)});
    const PlaneAxes axes{g.plane.offset_m * g.plane.normal, g.u, g.v};
    for (const PlaneRegion& slant : slants_) {
      const PlaneLoops behind = behindSlant(slant, axes, boxOf(loops));
      if (!behind.empty()) loops = without(loops, behind);
    }
    ++walls_;
    const std::size_t first = room_.planes.size();
    addParts(g, PlaneKind::kWall, "wall_" + std::to_string(walls_), loops);
    for (std::size_t i = first; i < room_.planes.size(); ++i) room_.planes[i].plane = run.group;
  }

  /// Each outer loop as a plane of its own, with the holes in it.
  void addParts(const PlaneGroup& g, PlaneKind kind, const std::string& name, const PlaneLoops& loops) {
    const ScanPlane plane = planeOf(g, kind);
    std::size_t outer = 0;
    for (const auto& loop : loops) outer += signedAreaOf(loop) > 0;
    std::size_t part = 0;
    for (const auto& loop : loops) {
      if (signedAreaOf(loop) <= 0) continue;
      ScanPlane own = plane;
      own.name = name + (outer > 1 ? std::string(1, static_cast<char>('a' + part++)) : "");
      own.outline = loop;
      for (const auto& hole : loops) {
        if (signedAreaOf(hole) < 0 && (outer == 1 || commonArea(loop, hole) > 0)) own.holes.push_back(hole);
      }
      finish(g, own);
    }
  }

  static double commonArea(const std::vector<Eigen::Vector2d>& loop, std::vector<Eigen::Vector2d> hole) {
    std::reverse(hole.begin(), hole.end());
    return areaWithin(commonPart({loop}, {hole}));
  }

  /// Rectangles of a wall that the scan does not have, though nothing before it hides them: windows and doorways. What
  /// has no such shape, and through which nothing is seen, is where the scan has gaps.
  std::vector<Eigen::AlignedBox2d> openings(const PlaneGroup& g, const WallRun& run, double top) {
    CellRaster wall(kCell_m), hides(kCell_m), beyond(kCell_m);
    for (const Eigen::Vector3f& q : samples_.points) {
      const Eigen::Vector3d p = q.cast<double>();
      const Eigen::Vector2d at = g.project(p);
      if (at.x() < run.from_m - 0.3 || at.x() > run.to_m + 0.3) continue;
      const double d = g.plane.distance(p);
      if (std::abs(d) < 2 * tolerance_m_) wall.set(at);
      if (d >= 2 * tolerance_m_ && d < kHides_m && at.x() > run.from_m + 0.05 && at.x() < run.to_m - 0.05)
        hides.set(at);
      if (d < -2 * tolerance_m_ - 0.05 && d > -4) beyond.set(at);
    }
    const Eigen::AlignedBox2d area(Eigen::Vector2d(run.from_m + 0.05, 0.05),
                                   Eigen::Vector2d(run.to_m - 0.05, top - 0.05));
    // Behind a slanted plane there is no wall that could be absent.
    for (double u = run.from_m; u < run.to_m && !slants_.empty(); u += kCell_m) {
      for (double z = 0; z < top; z += kCell_m) {
        const Eigen::Vector3d p = g.plane.offset_m * g.plane.normal + u * g.u + z * g.v;
        if (std::any_of(slants_.begin(), slants_.end(), [&](const auto& s) { return s.distance(p) < 2 * kCell_m; }))
          wall.set({u, z});
      }
    }
    std::vector<Eigen::AlignedBox2d> found;
    for (const RasterGap& gap : gapsOf(wall, area)) {
      const Eigen::Vector2d sizes = gap.box.sizes();
      if (sizes.minCoeff() < kLeastHole_m || gap.area_m2 < kLeastHole_m2) continue;
      const double hidden = hides.share(gap.box), seen = beyond.share(gap.box);
      const bool rectangle = gap.fill > (seen > 0.15 ? 0.6 : 0.85);
      if (hidden > 0.3 || !rectangle || gap.touches_side || sizes.x() > 0.9 * (run.to_m - run.from_m)) {
        if (hidden <= 0.3) room_.closed_m2 += gap.area_m2;
        continue;
      }
      Eigen::AlignedBox2d box = gap.box;
      if (box.min().y() < 0.15) box.min().y() = 0;
      found.push_back(box);
    }
    return found;
  }

  ScanPlane planeOf(const PlaneGroup& g, PlaneKind kind) const {
    ScanPlane plane;
    plane.kind = kind;
    plane.normal = g.plane.normal;
    plane.offset_m = g.plane.offset_m;
    plane.u = g.u;
    plane.v = g.v;
    plane.angle_std_deg = g.plane.angle_std_rad / kDegree;
    plane.turned_deg = g.plane.turned_rad / kDegree;
    return plane;
  }

  /// A plane's samples and those that lie on it though their own normals, of few noisy neighbours, kept them out.
  std::vector<int> withStragglers(const PlaneGroup& g) const {
    std::vector<char> taken(samples_.size(), 0);
    for (int i : g.plane.samples) taken[static_cast<std::size_t>(i)] = 1;
    for (int i : g.second_copy) taken[static_cast<std::size_t>(i)] = 1;
    std::vector<int> all = g.plane.samples;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (taken[i] || room_.owner[i] != -1) continue;
      if (std::abs(g.plane.distance(samples_.points[i].cast<double>())) > 1.5 * tolerance_m_) continue;
      if (std::abs(g.plane.normal.dot(samples_.normals[i].cast<double>())) > kStraggler)
        all.push_back(static_cast<int>(i));
    }
    return all;
  }

  /// Measures a plane by the samples within its bounds, which become its own.
  void finish(const PlaneGroup& g, ScanPlane plane) {
    const int id = static_cast<int>(room_.planes.size());
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& p : plane.outline) box.extend(p);
    box.min().array() -= kCell_m, box.max().array() += kCell_m;
    std::vector<double> distances;
    CellRaster covered(kCell_m);
    std::map<std::pair<int, int>, std::pair<double, double>> patches;
    for (int i : withStragglers(g)) {
      const Eigen::Vector3d p = sampleAt(samples_, i);
      const Eigen::Vector2d at = g.project(p);
      if (!box.contains(at) || room_.owner[static_cast<std::size_t>(i)] != -1) continue;
      room_.owner[static_cast<std::size_t>(i)] = id;
      const double d = g.plane.distance(p);
      distances.push_back(d);
      covered.set(at);
      auto& patch = patches[{static_cast<int>(std::floor(at.x() / 0.5)), static_cast<int>(std::floor(at.y() / 0.5))}];
      patch.first += d, patch.second += 1;
      plane.residuals.emplace_back(static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(d));
    }
    for (int i : g.second_copy) {
      if (!box.contains(g.project(sampleAt(samples_, i)))) continue;
      room_.owner[static_cast<std::size_t>(i)] = -2;
      room_.doubled_m2 += samples_.area_m2();
    }
    if (plane.kind == PlaneKind::kWall && covered.area_m2() < kLeastSeen_m2) {  // others hold nearly all of it
      std::replace(room_.owner.begin(), room_.owner.end(), id, -1);
      return;
    }
    plane.samples = distances.size();
    plane.covered_m2 = covered.area_m2();
    plane.area_m2 = std::abs(signedAreaOf(plane.outline));
    for (const auto& hole : plane.holes) plane.area_m2 -= std::abs(signedAreaOf(hole));
    if (!distances.empty()) {
      double squares = 0, bow = 0;
      for (double& d : distances) squares += d * d, d = std::abs(d);
      for (const auto& [place, patch] : patches) bow += patch.first * patch.first / patch.second;
      const auto count = static_cast<double>(distances.size());
      plane.rms_m = std::sqrt(squares / count);
      plane.bow_m = std::sqrt(bow / count);
      const auto most = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() * 99 / 100);
      std::nth_element(distances.begin(), most, distances.end());
      plane.largest_m = *most;
    }
    room_.planes.push_back(std::move(plane));
  }

  const std::string& file_;
  const ScanFrame& frame_;
  const ScanSamples& samples_;
  const double tolerance_m_;
  std::vector<PlaneGroup> groups_;
  std::vector<PlaneRegion> slants_;  // that bound the room from above
  RoomPlanes room_;
  int walls_ = 0;
};

}  // namespace

RoomPlanes roomPlanes(const std::string& file, const ScanFrame& frame, const ScanSamples& samples,
                      const std::vector<PlaneRegion>& regions, double yaw_rad, const std::vector<PlaneShift>& shifts) {
  return RoomBuilder(file, frame, samples, regions, yaw_rad, shifts).run();
}

}  // namespace mmradartwin
