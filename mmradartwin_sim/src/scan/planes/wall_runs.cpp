#include "scan/planes/wall_runs.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "scan/samples/cell_raster.h"
#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

/// Where other walls cross a wall, as places along it; only where the other wall reaches it.
std::vector<double> crossings(const RoomParts& room, std::size_t g) {
  std::vector<double> places;
  const PlaneGroup& wall = room.groups[g];
  for (std::size_t o = 0; o < room.groups.size(); ++o) {
    const PlaneGroup& other = room.groups[o];
    if (o == g || !other.wall || std::abs(other.plane.normal.dot(wall.plane.normal)) > 0.9) continue;
    // p on both planes: p = offset n + s u with other.n . p = other.offset.
    const double slope = other.plane.normal.dot(wall.u);
    const double s = (other.plane.offset_m - wall.plane.offset_m * other.plane.normal.dot(wall.plane.normal)) / slope;
    std::size_t near = 0;
    for (int i : other.plane.samples)
      near += std::abs(wall.plane.distance(room.samples.at(i))) < bounds::kSnap_m + 0.15;
    if (static_cast<double>(near) * room.samples.area_m2() > 0.05) places.push_back(s);
  }
  std::sort(places.begin(), places.end());
  return places;
}

void addRuns(const RoomParts& room, std::size_t g, std::vector<WallRun>& runs) {
  const PlaneGroup& wall = room.groups[g];
  std::map<int, std::set<int>> columns;
  for (int i : wall.plane.samples) {
    const Eigen::Vector2d p = wall.project(room.samples.at(i)) / bounds::kCell_m;
    columns[static_cast<int>(std::floor(p.x()))].insert(static_cast<int>(std::floor(p.y())));
  }
  const std::vector<double> places = crossings(room, g);
  const auto snapped = [&places](double at) {
    double best = at, least = bounds::kSnap_m;
    for (double s : places) {
      if (std::abs(s - at) < least) least = std::abs(s - at), best = s;
    }
    return best;
  };
  std::vector<WallRun> found;
  for (const auto& [column, rows] : columns) {
    if (static_cast<double>(rows.size()) * bounds::kCell_m < 0.12 * room.height_m) continue;
    const double from = column * bounds::kCell_m, to = from + bounds::kCell_m;
    const bool crossed = !found.empty() && std::any_of(places.begin(), places.end(), [&](double s) {
      return s > found.back().to_m - 0.02 && s < from + 0.02 && from - found.back().to_m > 0.1;
    });
    if (!found.empty() && from - found.back().to_m < bounds::kWallGap_m && !crossed) {
      found.back().to_m = to;
    } else {
      found.push_back({g, from, to, 0, {}});
    }
  }
  for (WallRun& run : found) {
    run.from_m = snapped(run.from_m), run.to_m = snapped(run.to_m);
    if (run.to_m - run.from_m > bounds::kLeastWall_m) runs.push_back(run);
  }
}

/// Rectangles of a wall that the scan does not have, though nothing before it hides them: windows and doorways. What
/// has no such shape, and through which nothing is seen, is where the scan has gaps.
std::vector<Eigen::AlignedBox2d> openingsOf(const RoomParts& room, const WallRun& run, double& closed_m2) {
  const PlaneGroup& g = room.groups[run.group];
  const double top = run.top_m;
  CellRaster wall(bounds::kCell_m), hides(bounds::kCell_m), beyond(bounds::kCell_m);
  for (int i = 0; i < static_cast<int>(room.samples.size()); ++i) {
    const Eigen::Vector3d p = room.samples.at(i);
    const Eigen::Vector2d at = g.project(p);
    if (at.x() < run.from_m - 0.3 || at.x() > run.to_m + 0.3) continue;
    const double d = g.plane.distance(p), tolerance_m = planeTolerance(room.samples, i, g.plane.normal);
    if (std::abs(d) < 2 * tolerance_m) wall.set(at);
    if (d >= 2 * tolerance_m && d < bounds::kHides_m && at.x() > run.from_m + 0.05 && at.x() < run.to_m - 0.05)
      hides.set(at);
    if (d < -2 * tolerance_m - 0.05 && d > -4) beyond.set(at);
  }
  const Eigen::AlignedBox2d area(Eigen::Vector2d(run.from_m + 0.05, 0.05),
                                 Eigen::Vector2d(run.to_m - 0.05, top - 0.05));
  // Behind a slanted plane there is no wall that could be absent.
  for (double u = run.from_m; u < run.to_m && !room.slants.empty(); u += bounds::kCell_m) {
    for (double z = 0; z < top; z += bounds::kCell_m) {
      const Eigen::Vector3d p = g.plane.offset_m * g.plane.normal + u * g.u + z * g.v;
      if (std::any_of(room.slants.begin(), room.slants.end(),
                      [&](const auto& s) { return s.distance(p) < 2 * bounds::kCell_m; }))
        wall.set({u, z});
    }
  }
  std::vector<Eigen::AlignedBox2d> found;
  for (const RasterGap& gap : gapsOf(wall, area)) {
    const Eigen::Vector2d sizes = gap.box.sizes();
    if (sizes.minCoeff() < bounds::kLeastHole_m || gap.area_m2 < bounds::kLeastHole_m2) continue;
    const double hidden = hides.share(gap.box), seen = beyond.share(gap.box);
    const bool rectangle = gap.fill > (seen > 0.15 ? 0.6 : 0.85);
    if (hidden > 0.3 || !rectangle || gap.touches_side || sizes.x() > 0.9 * (run.to_m - run.from_m)) {
      if (hidden <= 0.3) closed_m2 += gap.area_m2;
      continue;
    }
    Eigen::AlignedBox2d box = gap.box;
    if (box.min().y() < 0.15) box.min().y() = 0;
    found.push_back(box);
  }
  return found;
}

}  // namespace

std::array<Eigen::Vector2d, 2> endsOf(const RoomParts& room, const WallRun& run) {
  const PlaneGroup& g = room.groups[run.group];
  const Eigen::Vector3d foot = g.plane.offset_m * g.plane.normal;
  return {room.inMain(foot + run.from_m * g.u), room.inMain(foot + run.to_m * g.u)};
}

std::vector<WallRun> wallRuns(const RoomParts& room, double& closed_m2) {
  std::vector<WallRun> runs;
  for (std::size_t g = 0; g < room.groups.size(); ++g) {
    if (room.groups[g].wall) addRuns(room, g, runs);
  }
  for (WallRun& run : runs) {
    const PlaneGroup& g = room.groups[run.group];
    const bool to_top =
        room.frame.has_ceiling || g.high_m > room.height_m - bounds::kBelowTop_m || endsAtSlant(room, g);
    run.top_m = to_top ? room.height_m : g.high_m;
    run.openings = openingsOf(room, run, closed_m2);
  }
  return runs;
}

}  // namespace mmradartwin
