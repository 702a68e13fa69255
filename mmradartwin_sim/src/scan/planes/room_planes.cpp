#include "scan/planes/room_planes.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "mmradartwin_dsp/input_error.h"
#include "scan/planes/floor_outline.h"
#include "scan/planes/plane_groups.h"
#include "scan/planes/slanted_bounds.h"
#include "scan/planes/wall_runs.h"
#include "scan/samples/cell_raster.h"
#include "scan/samples/scan_bounds.h"
#include "scene/polygon_set.h"

namespace mmradartwin {
namespace {

constexpr double kStraggler = 0.7;  // cosine between a straggler's normal and its plane's

class RoomBuilder {
 public:
  RoomBuilder(const std::string& file, const RoomParts& parts) : file_(file), parts_(parts) {
    room_.yaw_rad = parts.yaw_rad;
    room_.height_m = parts.height_m;
    room_.owner.assign(parts.samples.size(), -1);
  }

  RoomPlanes run() {
    std::vector<WallRun> runs = wallRuns(parts_, room_.closed_m2);
    if (runs.empty())
      throw InputError(file_ + ": shows no wall, so that it is no room; outdoors and tables alone are no scenes");
    const std::size_t all = runs.size();
    const PlaneLoops floor = floorOutline(parts_, runs);
    if (all > runs.size())
      room_.notes.push_back(std::to_string(all - runs.size()) + " upright plane(s) outside of the room were left out");
    addFloorAndCeiling(floor);
    for (const WallRun& run : runs) addWall(run);
    if (walls_ == 0) throw InputError(file_ + ": shows no wall around its floor, so that it is no room");
    return std::move(room_);
  }

 private:
  void addFloorAndCeiling(const PlaneLoops& loops) {
    const Eigen::Vector2d ex(std::cos(parts_.yaw_rad), std::sin(parts_.yaw_rad));
    addLevel("floor", PlaneKind::kFloor, 1, 0, belowSlants(loops, 0), ex);
    if (parts_.frame.has_ceiling)
      addLevel("ceiling", PlaneKind::kCeiling, -1, parts_.frame.ceiling_m, belowSlants(loops, parts_.frame.ceiling_m),
               ex);
    for (std::size_t i = 0; i < parts_.slants.size(); ++i) addSlant(i, loops);
  }

  /// Axes of the main directions at a height.
  PlaneAxes mainAxes(double height_m) const {
    const double c = std::cos(parts_.yaw_rad), s = std::sin(parts_.yaw_rad);
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
    for (const PlaneRegion& slant : parts_.slants) {
      const PlaneLoops behind = behindSlant(slant, mainAxes(height_m), boxOf(loops));
      if (!behind.empty()) loops = without(loops, behind);
    }
    return loops;
  }

  /// The part of a slanted plane between floor and ceiling, over the floor and below the other slanted planes.
  void addSlant(std::size_t index, PlaneLoops loops) {
    PlaneGroup group;
    group.plane = parts_.slants[index];
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
    for (std::size_t i = 0; i < parts_.slants.size(); ++i) {
      if (i != index) limits.push_back(parts_.slants[i]);
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

  void addLevel(const std::string& name, PlaneKind kind, int side, double height_m, const PlaneLoops& loops,
                const Eigen::Vector2d& ex) {
    // Samples of the level, of whichever part.
    PlaneGroup level;
    level.plane.normal = side * Eigen::Vector3d::UnitZ();
    level.plane.offset_m = side * height_m;
    level.u = {ex.x(), ex.y(), 0};
    level.v = level.plane.normal.cross(level.u);
    for (const PlaneGroup& g : parts_.groups) {
      if (!isLevel(g.plane) || std::abs(g.plane.middle.z() - height_m) > bounds::kSameSurface_m) continue;
      if (std::abs(g.plane.middle.z() - height_m) < planeTolerance(parts_.samples, g.plane)) {
        level.plane.samples.insert(level.plane.samples.end(), g.plane.samples.begin(), g.plane.samples.end());
      } else if (overlap(parts_.samples, level, g.plane) >
                 0.5) {  // groups come largest first; a carpet hides the floor
        level.second_copy.insert(level.second_copy.end(), g.plane.samples.begin(), g.plane.samples.end());
      }
      level.second_copy.insert(level.second_copy.end(), g.second_copy.begin(), g.second_copy.end());
    }
    measurePlane(parts_.samples, level.plane);
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
    const PlaneGroup& g = parts_.groups[run.group];
    const double top = run.top_m;
    PlaneLoops loops = {{{run.from_m, 0}, {run.to_m, 0}, {run.to_m, top}, {run.from_m, top}}};
    for (const Eigen::AlignedBox2d& hole : run.openings) loops = without(loops, {loopOf(hole)});
    const PlaneAxes axes{g.plane.offset_m * g.plane.normal, g.u, g.v};
    for (const PlaneRegion& slant : parts_.slants) {
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

  ScanPlane planeOf(const PlaneGroup& g, PlaneKind kind) const {
    ScanPlane plane;
    plane.kind = kind;
    plane.normal = g.plane.normal;
    plane.offset_m = g.plane.offset_m;
    plane.u = g.u;
    plane.v = g.v;
    plane.angle_std_deg = g.plane.angle_std_rad / bounds::kDegree;
    plane.turned_deg = g.plane.turned_rad / bounds::kDegree;
    return plane;
  }

  /// A plane's samples and those that lie on it though their own normals, of few noisy neighbours, kept them out.
  std::vector<int> withStragglers(const PlaneGroup& g) const {
    std::vector<char> taken(parts_.samples.size(), 0);
    for (int i : g.plane.samples) taken[static_cast<std::size_t>(i)] = 1;
    for (int i : g.second_copy) taken[static_cast<std::size_t>(i)] = 1;
    std::vector<int> all = g.plane.samples;
    for (std::size_t i = 0; i < parts_.samples.size(); ++i) {
      if (taken[i] || room_.owner[i] != -1) continue;
      if (std::abs(g.plane.distance(parts_.samples.points[i].cast<double>())) >
          1.5 * planeTolerance(parts_.samples, static_cast<int>(i), g.plane.normal))
        continue;
      if (std::abs(g.plane.normal.dot(parts_.samples.normals[i].cast<double>())) > kStraggler)
        all.push_back(static_cast<int>(i));
    }
    return all;
  }

  /// Measures a plane by the samples within its bounds, which become its own.
  void finish(const PlaneGroup& g, ScanPlane plane) {
    const int id = static_cast<int>(room_.planes.size());
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& p : plane.outline) box.extend(p);
    box.min().array() -= bounds::kCell_m, box.max().array() += bounds::kCell_m;
    std::vector<double> distances;
    CellRaster covered(bounds::kCell_m);
    std::map<std::pair<int, int>, std::pair<double, double>> patches;
    for (int i : withStragglers(g)) {
      const Eigen::Vector3d p = parts_.samples.at(i);
      const Eigen::Vector2d at = g.project(p);
      if (!box.contains(at) || room_.owner[static_cast<std::size_t>(i)] != -1) continue;
      room_.owner[static_cast<std::size_t>(i)] = id;
      const double d = g.plane.distance(p);
      distances.push_back(d);
      covered.set(at);
      auto& patch = patches[{static_cast<int>(std::floor(at.x() / bounds::kDriftPatch_m)),
                             static_cast<int>(std::floor(at.y() / bounds::kDriftPatch_m))}];
      patch.first += d, patch.second += 1;
      plane.residuals.emplace_back(static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(d));
    }
    for (int i : g.second_copy) {
      if (!box.contains(g.project(parts_.samples.at(i)))) continue;
      int& owner = room_.owner[static_cast<std::size_t>(i)];
      if (owner == -1) owner = -2;
      room_.doubled_m2 += parts_.samples.area_m2();
    }
    if (plane.kind == PlaneKind::kWall && covered.area_m2() < bounds::kLeastSeen_m2) {  // others hold nearly all of it
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
  const RoomParts& parts_;
  RoomPlanes room_;
  int walls_ = 0;
};

}  // namespace

RoomPlanes roomPlanes(const std::string& file, const ScanFrame& frame, const ScanSamples& samples,
                      const std::vector<PlaneRegion>& regions, double yaw_rad, const std::vector<PlaneShift>& shifts) {
  const RoomParts parts = roomParts(frame, samples, regions, yaw_rad, shifts);
  return RoomBuilder(file, parts).run();
}

}  // namespace mmradartwin
