#include "scene/polygon_set.h"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <cmath>

namespace mmradartwin {
namespace {

namespace bg = boost::geometry;
using Point = bg::model::d2::point_xy<double>;
using Polygon = bg::model::polygon<Point, false, true>;  // counter-clockwise, closed
using Polygons = bg::model::multi_polygon<Polygon>;

double signedArea(const std::vector<Eigen::Vector2d>& loop) {
  double sum = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d a = loop[i] - loop[0], b = loop[(i + 1) % loop.size()] - loop[0];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * sum;
}

Polygon::ring_type ringOf(const std::vector<Eigen::Vector2d>& loop) {
  Polygon::ring_type ring;
  for (const Eigen::Vector2d& p : loop) ring.emplace_back(p.x(), p.y());
  if (!loop.empty()) ring.emplace_back(loop.front().x(), loop.front().y());
  return ring;
}

/// The loops as polygons with their holes; empty where they are none.
Polygons polygonsOf(const PlaneLoops& loops) {
  Polygons polygons;
  std::vector<double> area;
  for (const auto& loop : loops) {
    const double own = signedArea(loop);
    if (own <= 0) continue;
    polygons.emplace_back();
    polygons.back().outer() = ringOf(loop);
    area.push_back(own);
  }
  for (const auto& loop : loops) {
    if (signedArea(loop) >= 0) continue;
    // The smallest outer loop about a hole is its own.
    int best = -1;
    for (std::size_t i = 0; i < polygons.size(); ++i) {
      const bool holds = std::all_of(loop.begin(), loop.end(), [&](const Eigen::Vector2d& p) {
        return bg::covered_by(Point(p.x(), p.y()), polygons[i].outer());
      });
      if (holds && (best < 0 || area[i] < area[static_cast<std::size_t>(best)])) best = static_cast<int>(i);
    }
    if (best >= 0) polygons[static_cast<std::size_t>(best)].inners().push_back(ringOf(loop));
  }
  if (!bg::is_valid(polygons)) polygons.clear();
  return polygons;
}

void addLoop(const Polygon::ring_type& ring, PlaneLoops& loops) {
  std::vector<Eigen::Vector2d> loop;
  for (const Point& p : ring) loop.emplace_back(p.x(), p.y());
  if (loop.size() > 1 && loop.front() == loop.back()) loop.pop_back();
  if (loop.size() >= 3) loops.push_back(std::move(loop));
}

PlaneLoops loopsOf(const Polygons& polygons) {
  PlaneLoops loops;
  for (const Polygon& polygon : polygons) {
    addLoop(polygon.outer(), loops);
    for (const auto& hole : polygon.inners()) addLoop(hole, loops);
  }
  return loops;
}

}  // namespace

double areaWithin(const PlaneLoops& loops) {
  double sum = 0;
  for (const auto& loop : loops) sum += signedArea(loop);
  return sum;
}

PlaneLoops commonPart(const PlaneLoops& a, const PlaneLoops& b) {
  const Polygons of_a = polygonsOf(a), of_b = polygonsOf(b);
  if (of_a.empty() || of_b.empty()) return {};
  Polygons common;
  try {
    bg::intersection(of_a, of_b, common);
  } catch (const bg::exception&) {
    return {};
  }
  return loopsOf(common);
}

PlaneLoops without(const PlaneLoops& a, const PlaneLoops& b) {
  const Polygons of_a = polygonsOf(a), of_b = polygonsOf(b);
  if (of_a.empty() || of_b.empty()) return a;
  Polygons rest;
  try {
    bg::difference(of_a, of_b, rest);
  } catch (const bg::exception&) {
    return a;
  }
  return loopsOf(rest);
}

}  // namespace mmradartwin
