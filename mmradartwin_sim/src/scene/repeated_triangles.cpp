#include "scene/repeated_triangles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace mmradartwin {
namespace {

using Corners = std::vector<Eigen::Vector2d>;

constexpr double kWhole = 1 - 1e-4;            // of a triangle's area
constexpr double kTouch = 1e-7;                // of the smaller triangle's area: rounding
constexpr double kFullTurn = 2 * M_PI + 0.05;  // of angles about a vertex, and rounding

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double areaOf(const Corners& p) {
  double sum = 0;
  for (std::size_t i = 1; i + 1 < p.size(); ++i) sum += cross(p[i] - p[0], p[i + 1] - p[0]);
  return 0.5 * sum;
}

Corners outline(const PlaneTriangle& t) {
  Corners polygon;
  for (const Eigen::Vector3d& p : t.place) polygon.push_back(p.head<2>());
  return polygon;
}

/// Height of a triangle's plane at a place.
double heightAt(const PlaneTriangle& t, const Eigen::Vector2d& at) {
  const Eigen::Vector3d u = t.place[1] - t.place[0], v = t.place[2] - t.place[0], n = u.cross(v);
  return t.place[0].z() - n.head<2>().dot(at - t.place[0].head<2>()) / n.z();
}

/// Area that two triangles share (Sutherland and Hodgman), 0 where one is higher than the other.
double sharedArea(const PlaneTriangle& a, const PlaneTriangle& b, double same_m) {
  Corners part = outline(a);
  for (int k = 0; k < 3 && !part.empty(); ++k) {
    const Eigen::Vector2d from = b.place[k].head<2>(), along = b.place[(k + 1) % 3].head<2>() - from;
    Corners kept;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Eigen::Vector2d &p = part[i], &q = part[(i + 1) % part.size()];
      const double hp = cross(along, p - from), hq = cross(along, q - from);
      if (hp >= 0) kept.push_back(p);
      if ((hp > 0 && hq < 0) || (hp < 0 && hq > 0)) kept.push_back(p + hp / (hp - hq) * (q - p));
    }
    part = std::move(kept);
  }
  for (const Eigen::Vector2d& p : part) {
    if (!(std::abs(heightAt(a, p) - heightAt(b, p)) <= same_m)) return 0;
  }
  return areaOf(part);
}

/// Triangles side by side share an edge in opposite directions, leave a vertex of the rim once and fill a full turn
/// about a vertex at most.
bool maySome(const std::vector<PlaneTriangle>& triangles) {
  std::vector<std::pair<int, int>> edges;
  std::map<int, double> turn;
  for (const PlaneTriangle& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      edges.emplace_back(t.corner[k], t.corner[(k + 1) % 3]);
      const Eigen::Vector3d u = t.place[(k + 1) % 3] - t.place[k], v = t.place[(k + 2) % 3] - t.place[k];
      turn[t.corner[k]] += std::atan2(u.cross(v).norm(), u.dot(v));
    }
  }
  if (std::any_of(turn.begin(), turn.end(), [](const auto& t) { return t.second > kFullTurn; })) return true;
  std::sort(edges.begin(), edges.end());
  if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return true;
  int last = -1;
  for (const auto& e : edges) {
    if (std::binary_search(edges.begin(), edges.end(), std::make_pair(e.second, e.first))) continue;
    if (e.first == last) return true;
    last = e.first;
  }
  return false;
}

}  // namespace

std::vector<std::size_t> repeatedTriangles(const std::vector<PlaneTriangle>& triangles, double same_m) {
  std::vector<std::size_t> repeated;
  if (!maySome(triangles)) return repeated;
  std::vector<Eigen::AlignedBox3d> box;
  std::vector<double> area;
  for (const PlaneTriangle& t : triangles) {
    box.emplace_back(t.place[0]);
    box.back().extend(t.place[1]).extend(t.place[2]);
    box.back().max().z() += same_m;
    area.push_back(areaOf(outline(t)));
  }
  std::vector<std::size_t> order(triangles.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return box[a].min().x() < box[b].min().x(); });
  // [later]: earlier ones, and the area shared.
  std::vector<std::vector<std::pair<std::size_t, double>>> under(triangles.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t j = i + 1; j < order.size() && box[order[j]].min().x() < box[order[i]].max().x(); ++j) {
      const std::size_t a = std::min(order[i], order[j]), b = std::max(order[i], order[j]);
      if (!box[a].intersects(box[b])) continue;
      const double shared = sharedArea(triangles[a], triangles[b], same_m);
      if (shared > kTouch * std::min(area[a], area[b])) under[b].emplace_back(a, shared);
    }
  }
  std::vector<char> kept(triangles.size(), 1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    double covered = 0;
    for (const auto& [other, shared] : under[t]) covered += kept[other] ? shared : 0;
    if (covered < kWhole * area[t]) continue;
    kept[t] = 0;
    repeated.push_back(t);
  }
  return repeated;
}

}  // namespace mmradartwin
