#include "scan/planes/floor_outline.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "scan/planes/floor_cells.h"
#include "scan/planes/polygon_triangles.h"
#include "scan/samples/cell_raster.h"
#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

constexpr double kOpenStep_m = 1.0;  // by which the floor follows the scan where no wall bounds it

std::vector<int> floorSamples(const RoomParts& room) {
  std::vector<int> all;
  for (const PlaneGroup& g : room.groups) {
    if (isLevel(g.plane) && (std::abs(g.plane.middle.z()) < bounds::kSameSurface_m ||
                             std::abs(g.plane.middle.z() - room.height_m) < bounds::kSameSurface_m)) {
      all.insert(all.end(), g.plane.samples.begin(), g.plane.samples.end());
    }
  }
  return all;
}

FloorCells cutFloor(const RoomParts& room, const std::vector<WallRun>& runs) {
  std::set<double> xs, ys;
  Eigen::AlignedBox2d box;
  for (int i : floorSamples(room)) box.extend(room.inMain(room.samples.at(i)));
  std::vector<Eigen::Vector2d> slanted;
  for (const WallRun& run : runs) {
    const auto [p, q] = endsOf(room, run);
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
  for (const Eigen::Vector2d& p : slanted) add(xs, p.x(), bounds::kSnap_m), add(ys, p.y(), bounds::kSnap_m);
  add(xs, box.min().x(), bounds::kSnap_m), add(xs, box.max().x(), bounds::kSnap_m);
  add(ys, box.min().y(), bounds::kSnap_m), add(ys, box.max().y(), bounds::kSnap_m);
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
bool walled(const RoomParts& room, const std::vector<WallRun>& runs, const FloorCells& cells, std::size_t i,
            std::size_t k, const CellStep& side) {
  const bool across_x = side[0] != 0;
  const double line = across_x ? cells.xs[i + (side[0] > 0)] : cells.ys[k + (side[1] > 0)];
  const double low = across_x ? cells.ys[k] : cells.xs[i], high = across_x ? cells.ys[k + 1] : cells.xs[i + 1];
  double covered = 0;
  for (const WallRun& run : runs) {
    const auto [p, q] = endsOf(room, run);
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

bool facesRoom(const RoomParts& room, const WallRun& run, const FloorCells& cells) {
  const auto [p, q] = endsOf(room, run);
  const PlaneGroup& g = room.groups[run.group];
  const Eigen::Vector2d n = room.inMain(g.plane.normal);
  int inside = 0, behind = 0;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector2d at = p + (i + 0.5) / 10 * (q - p);
    inside += cells.holds(at + 0.1 * n);
    behind += cells.holds(at - 0.25 * n);
  }
  // A low or narrow plane in the midst of the room is a partition, a cabinet's or a pillar's.
  if ((g.high_m < room.height_m - bounds::kBelowTop_m || run.to_m - run.from_m < bounds::kPillar_m) && behind > 3)
    return false;
  return inside >= 4;
}

/// Cells are rectangles along the main directions, so that they reach behind a wall that cuts a corner. What lies
/// behind such a wall, as far as a right angle over it goes, is none of the room where the scan has nothing there.
PlaneLoops withoutCorners(const RoomParts& room, const std::vector<WallRun>& runs, const CellRaster& scanned,
                          PlaneLoops loops) {
  for (const WallRun& run : runs) {
    const auto [p, q] = endsOf(room, run);
    const Eigen::Vector2d along = q - p, n = room.inMain(room.groups[run.group].plane.normal);
    if (std::abs(along.x()) < 1e-6 || std::abs(along.y()) < 1e-6) continue;
    const double depth_m = 0.5 * along.norm() + bounds::kSnap_m;
    std::size_t seen = 0, all = 0;
    for (double a = bounds::kCell_m; a < along.norm(); a += 2 * bounds::kCell_m) {
      for (double d = 4 * bounds::kCell_m; d < depth_m; d += 2 * bounds::kCell_m, ++all) {
        const Eigen::Vector2d at = p + a * along.normalized() - d * n;
        seen += scanned.has(scanned.index(at.x()), scanned.index(at.y()));
      }
    }
    // Of a wall that drift has doubled the outer copy ends the floor, so that no gap is left between them.
    const bool is_inner = std::any_of(runs.begin(), runs.end(), [&](const WallRun& other) {
      const double behind_m = (p - endsOf(room, other)[0]).dot(room.inMain(room.groups[other.group].plane.normal));
      return n.dot(room.inMain(room.groups[other.group].plane.normal)) > bounds::kParallel && behind_m > 1e-3 &&
             behind_m < depth_m;
    });
    if (is_inner || 10 * seen > all) continue;
    // The wall's place is known to the tolerance: the floor ends behind it.
    const Eigen::Vector2d near = planeTolerance(room.samples, room.groups[run.group].plane) * n, far = depth_m * n;
    std::vector<Eigen::Vector2d> behind = {p - near, q - near, q - far, p - far};
    if (signedAreaOf(behind) < 0) std::reverse(behind.begin(), behind.end());
    loops = without(loops, {behind});
  }
  return loops;
}

}  // namespace

std::vector<Eigen::Vector2d> loopOf(const Eigen::AlignedBox2d& box) {
  return {box.min(), {box.max().x(), box.min().y()}, box.max(), {box.min().x(), box.max().y()}};
}

PlaneLoops floorOutline(const RoomParts& room, std::vector<WallRun>& runs) {
  FloorCells cells = cutFloor(room, runs);
  const std::size_t columns = cells.xs.size() - 1, rows = cells.ys.size() - 1;
  CellRaster scanned(2 * bounds::kCell_m);
  for (const Eigen::Vector3f& p : room.samples.points) {
    if (p.z() > -0.3F && p.z() < static_cast<float>(room.height_m) + 0.3F) scanned.set(room.inMain(p.cast<double>()));
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
    return walled(room, runs, cells, i, k, step);
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
               [&](const WallRun& run) { return facesRoom(room, run, cells); });
  // One frame of a camera may show walls apart from all floor.
  if (!facing.empty()) runs = facing;
  return withoutCorners(room, runs, scanned, loops);
}

}  // namespace mmradartwin
