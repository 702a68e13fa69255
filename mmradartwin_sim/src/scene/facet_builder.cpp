#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <unordered_map>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/scene.h"
#include "scene/closed_body.h"
#include "scene/curved_surface.h"
#include "scene/facet_relations.h"
#include "scene/repeated_triangles.h"
#include "scene/vertex_weld.h"

namespace mmradartwin {
namespace {

using Index3 = std::array<int, 3>;

constexpr double kSmallestArea_m2 = 1e-12;

double cross2(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

std::vector<Eigen::Vector2d> convexHull(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  std::vector<Eigen::Vector2d> hull;
  const auto extend = [&hull](const Eigen::Vector2d& p, std::size_t keep) {
    while (hull.size() >= keep + 2 && cross2(hull[hull.size() - 2], hull.back(), p) <= 1e-14) hull.pop_back();
    hull.push_back(p);
  };
  for (const auto& p : points) extend(p, 0);
  const std::size_t lower = hull.size() - 1;
  for (auto it = points.rbegin() + 1; it != points.rend(); ++it) extend(*it, lower);
  if (hull.size() > 1) hull.pop_back();
  return hull;
}

/// Direction of the smallest bounding rectangle (it lies along an edge of the hull).
Eigen::Vector2d rectangleAxis(const std::vector<Eigen::Vector2d>& hull) {
  Eigen::Vector2d best(1, 0);
  double best_area = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull.size(); ++i) {
    Eigen::Vector2d axis = hull[(i + 1) % hull.size()] - hull[i];
    if (axis.norm() < 1e-9) continue;
    axis.normalize();
    const Eigen::Vector2d side(-axis.y(), axis.x());
    double low1 = 1e300, high1 = -1e300, low2 = 1e300, high2 = -1e300;
    for (const auto& p : hull) {
      low1 = std::min(low1, p.dot(axis));
      high1 = std::max(high1, p.dot(axis));
      low2 = std::min(low2, p.dot(side));
      high2 = std::max(high2, p.dot(side));
    }
    const double area = (high1 - low1) * (high2 - low2);
    if (area < best_area * (1 - 1e-9)) {
      best_area = area;
      best = axis;
    }
  }
  return best;
}

/// Closed boundary loops of triangles that lie in one plane, counter-clockwise about the normal, holes clockwise.
std::vector<std::vector<int>> boundaryLoops(const std::vector<Index3>& triangles) {
  std::map<std::pair<int, int>, int> edges;  // directed edge -> how often more than its reverse
  for (const Index3& t : triangles) {
    for (int i = 0; i < 3; ++i) {
      const int a = t[i], b = t[(i + 1) % 3];
      const auto reverse = edges.find({b, a});
      if (reverse != edges.end()) {
        if (--reverse->second == 0) edges.erase(reverse);
      } else {
        ++edges[{a, b}];
      }
    }
  }
  std::vector<std::vector<int>> loops;
  while (!edges.empty()) {
    std::vector<int> loop;
    int at = edges.begin()->first.first;
    const int start = at;
    do {
      const auto next = edges.lower_bound({at, std::numeric_limits<int>::min()});
      if (next == edges.end() || next->first.first != at) break;
      loop.push_back(at);
      at = next->first.second;
      if (--next->second == 0) edges.erase(next);
    } while (at != start);
    if (loop.size() >= 3) loops.push_back(loop);
  }
  return loops;
}

void dropCollinear(std::vector<Eigen::Vector2d>& loop) {
  bool dropped = true;
  while (dropped && loop.size() > 3) {
    dropped = false;
    for (std::size_t i = 0; i < loop.size() && loop.size() > 3; ++i) {
      const auto& a = loop[(i + loop.size() - 1) % loop.size()];
      const auto& c = loop[(i + 1) % loop.size()];
      const double base = (c - a).norm();
      if (std::abs(cross2(a, loop[i], c)) < 1e-7 * std::max(base, 1e-3)) {
        loop.erase(loop.begin() + static_cast<long>(i));
        dropped = true;
        --i;
      }
    }
  }
}

struct ActorMesh {
  const Actor& actor;
  std::vector<int> weld;
  std::vector<Index3> triangles;        // welded indices
  std::vector<Eigen::Vector3d> normal;  // zero where the triangle has no area or repeats another
  std::vector<double> area;
  double repeated_m2 = 0;  // of triangles with the corners of another
};

ActorMesh prepare(const Actor& actor) {
  ActorMesh mesh{actor, weldVertices(actor.vertices), {}, {}, {}, 0};
  std::set<Index3> seen;
  for (const Index3& t : actor.triangles) {
    const Index3 w = {mesh.weld[t[0]], mesh.weld[t[1]], mesh.weld[t[2]]};
    const Eigen::Vector3d n =
        (actor.vertices[t[1]] - actor.vertices[t[0]]).cross(actor.vertices[t[2]] - actor.vertices[t[0]]);
    Index3 key = w;
    std::sort(key.begin(), key.end());
    const double area = 0.5 * n.norm();
    const bool whole = area > kSmallestArea_m2 && key[0] != key[1] && key[1] != key[2];
    const bool usable = whole && seen.insert(key).second;
    if (whole && !usable) mesh.repeated_m2 += area;
    mesh.triangles.push_back(w);
    mesh.area.push_back(usable ? area : 0);
    mesh.normal.push_back(usable ? Eigen::Vector3d(n.normalized()) : Eigen::Vector3d::Zero());
  }
  return mesh;
}

/// The plane that triangles of a mesh lie in, by their areas.
struct MeanPlane {
  Eigen::Vector3d normal, centroid;
  double area_m2;
};

MeanPlane meanPlane(const ActorMesh& mesh, const std::vector<int>& members) {
  const auto& vertices = mesh.actor.vertices;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(), centroid = Eigen::Vector3d::Zero();
  double area = 0;
  const Eigen::Vector3d seed = mesh.normal[members.front()];
  for (int t : members) {
    normal += mesh.area[t] * (mesh.normal[t].dot(seed) < 0 ? -mesh.normal[t] : mesh.normal[t]);
    const Index3& w = mesh.triangles[t];
    centroid += mesh.area[t] * (vertices[w[0]] + vertices[w[1]] + vertices[w[2]]) / 3.0;
    area += mesh.area[t];
  }
  normal.normalize();
  centroid /= area;
  return {normal, centroid, area};
}

/// Least and largest coordinate of points along a direction.
std::pair<double, double> extentAlong(const std::vector<Eigen::Vector2d>& points, const Eigen::Vector2d& direction) {
  double low = 1e300, high = -1e300;
  for (const auto& p : points) {
    low = std::min(low, p.dot(direction));
    high = std::max(high, p.dot(direction));
  }
  return {low, high};
}

/// Makes the facet of some coplanar triangles of a mesh.
Facet makeFacet(const ActorMesh& mesh, const std::vector<int>& members) {
  const auto& vertices = mesh.actor.vertices;
  const auto [normal, centroid, area] = meanPlane(mesh, members);
  Facet facet;
  facet.area_m2 = area;

  // A first frame in the plane, then the axes of the smallest rectangle.
  const Index3& first = mesh.triangles[members.front()];
  Eigen::Vector3d a = vertices[first[1]] - vertices[first[0]];
  a = (a - a.dot(normal) * normal).normalized();
  const Eigen::Vector3d b = normal.cross(a);
  const auto project = [&vertices, &a, &b, &centroid = centroid](int v) {
    return Eigen::Vector2d((vertices[v] - centroid).dot(a), (vertices[v] - centroid).dot(b));
  };
  std::vector<Index3> oriented;
  std::vector<int> used;
  for (int t : members) {
    Index3 w = mesh.triangles[t];
    if (cross2(project(w[0]), project(w[1]), project(w[2])) < 0) std::swap(w[1], w[2]);
    oriented.push_back(w);
    used.insert(used.end(), w.begin(), w.end());
  }
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  std::vector<Eigen::Vector2d> points;
  for (int v : used) {
    points.push_back(project(v));
    facet.flatness_m = std::max(facet.flatness_m, std::abs((vertices[v] - centroid).dot(normal)));
  }
  const std::vector<Eigen::Vector2d> hull = convexHull(points);
  Eigen::Vector2d axis = rectangleAxis(hull);
  const auto extent = [&hull](const Eigen::Vector2d& direction) { return extentAlong(hull, direction); };
  // Axes and origin are told from the facet's own shape (long side first) and, where that is symmetric, from its first
  // triangle: scatter points are hashed in these coordinates and have to move with the actor.
  const auto size = [&extent](const Eigen::Vector2d& d) { return extent(d).second - extent(d).first; };
  const Eigen::Vector2d side(-axis.y(), axis.x());
  const double long_by = size(axis) - size(side);
  if (long_by < -1e-6 || (std::abs(long_by) <= 1e-6 && std::abs(axis.x()) + 1e-6 < std::abs(side.x()))) axis = side;
  const Eigen::Vector2d anchor = project(first[0]);
  const auto range1 = extent(axis);
  if (anchor.dot(axis) - range1.first > range1.second - anchor.dot(axis) + 1e-6) axis = -axis;
  Eigen::Vector2d second(-axis.y(), axis.x());
  const auto range2 = extent(second);
  if (anchor.dot(second) - range2.first > range2.second - anchor.dot(second) + 1e-6) second = -second;
  facet.e1 = (axis.x() * a + axis.y() * b).normalized();
  facet.e2 = (second.x() * a + second.y() * b).normalized();
  facet.normal = facet.e1.cross(facet.e2);
  const Eigen::Vector2d low(extent(axis).first, extent(second).first);
  facet.size1_m = size(axis);
  facet.size2_m = size(second);
  facet.origin = centroid + low.x() * facet.e1 + low.y() * facet.e2;
  facet.rectangle = area > facet.size1_m * facet.size2_m * (1 - 1e-5);

  const bool mirrored = axis.x() * second.y() - axis.y() * second.x() < 0;
  for (const auto& indices : boundaryLoops(oriented)) {
    std::vector<Eigen::Vector2d> loop;
    for (int v : indices) {
      const Eigen::Vector2d p = project(v);
      loop.emplace_back(p.dot(axis) - low.x(), p.dot(second) - low.y());
    }
    if (mirrored) std::reverse(loop.begin(), loop.end());
    dropCollinear(loop);
    facet.loops.push_back(std::move(loop));
  }
  facet.reflects = std::abs(facet.normal.z()) < std::sqrt(0.5);
  return facet;
}

/// Groups of triangles that are one facet, each in ascending order, by region growing from the largest triangle.
std::vector<std::vector<int>> growRegions(const ActorMesh& mesh, const FacetTolerance& tolerance) {
  const int count = static_cast<int>(mesh.triangles.size());
  // Neighbours share a vertex: across a T-junction triangles share no whole edge.
  std::unordered_map<int, std::vector<int>> at_vertex;
  for (int t = 0; t < count; ++t) {
    if (mesh.area[t] <= 0) continue;
    for (int v : mesh.triangles[t]) at_vertex[v].push_back(t);
  }
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return mesh.area[a] > mesh.area[b] * (1 + 1e-6); });
  const double cosine = std::cos(tolerance.angle_deg * M_PI / 180);
  std::vector<int> region(static_cast<std::size_t>(count), -1);
  std::vector<std::vector<int>> regions;
  for (int seed : order) {
    if (mesh.area[seed] <= 0 || region[seed] >= 0) continue;
    const int id = static_cast<int>(regions.size());
    std::vector<int> members = {seed};
    region[seed] = id;
    // The plane follows the area-weighted mean, so that a noisy seed does not tilt a wall.
    Eigen::Vector3d weighted = mesh.area[seed] * mesh.normal[seed];
    const Index3& s = mesh.triangles[seed];
    const auto& v = mesh.actor.vertices;
    Eigen::Vector3d moment = mesh.area[seed] * (v[s[0]] + v[s[1]] + v[s[2]]) / 3.0;
    double area = mesh.area[seed];
    for (std::size_t i = 0; i < members.size(); ++i) {
      for (int corner : mesh.triangles[members[i]]) {
        for (int t : at_vertex[corner]) {
          if (region[t] >= 0) continue;
          const Eigen::Vector3d n = weighted.normalized(), c = moment / area;
          if (std::abs(n.dot(mesh.normal[t])) < cosine) continue;
          const Index3& w = mesh.triangles[t];
          bool flat = true;
          for (int corner_index : w) flat = flat && std::abs((v[corner_index] - c).dot(n)) <= tolerance.offset_m;
          if (!flat) continue;
          region[t] = id;
          members.push_back(t);
          weighted += mesh.area[t] * (mesh.normal[t].dot(n) < 0 ? -mesh.normal[t] : mesh.normal[t]);
          moment += mesh.area[t] * (v[w[0]] + v[w[1]] + v[w[2]]) / 3.0;
          area += mesh.area[t];
        }
      }
    }
    std::sort(members.begin(), members.end());
    regions.push_back(std::move(members));
  }
  std::sort(regions.begin(), regions.end());
  return regions;
}

/// Takes triangles out of a region that lie on others of it; returns their area.
double dropRepeated(const ActorMesh& mesh, std::vector<int>& members) {
  if (members.size() < 2) return 0;
  const MeanPlane plane = meanPlane(mesh, members);
  const Eigen::Vector3d a = plane.normal.unitOrthogonal(), b = plane.normal.cross(a);
  std::vector<PlaneTriangle> flat;
  for (int t : members) {
    PlaneTriangle f;
    f.corner = mesh.triangles[t];
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d p = mesh.actor.vertices[f.corner[k]] - plane.centroid;
      f.place[k] = {p.dot(a), p.dot(b), p.dot(plane.normal)};
    }
    if ((f.place[1] - f.place[0]).cross(f.place[2] - f.place[0]).z() < 0) {
      std::swap(f.corner[1], f.corner[2]);
      std::swap(f.place[1], f.place[2]);
    }
    flat.push_back(f);
  }
  double area = 0;
  const std::vector<std::size_t> repeated = repeatedTriangles(flat, kSamePlane_m);
  for (auto i = repeated.rbegin(); i != repeated.rend(); ++i) {
    area += mesh.area[members[*i]];
    members.erase(members.begin() + static_cast<long>(*i));
  }
  return area;
}

/// Facets of one actor, behind those that are there.
void buildFacets(Scene& scene, int index) {
  Actor& actor = scene.actors[static_cast<std::size_t>(index)];
  actor.facets.clear();
  actor.bounds.setEmpty();
  for (const auto& p : actor.vertices) actor.bounds.extend(p);
  actor.triangle_facet.assign(actor.triangles.size(), -1);
  const ActorMesh mesh = prepare(actor);
  actor.repeated_m2 = mesh.repeated_m2;
  std::vector<std::vector<int>> regions = growRegions(mesh, scene.tolerance);
  for (std::vector<int>& members : regions) {
    actor.repeated_m2 += dropRepeated(mesh, members);
    Facet facet = makeFacet(mesh, members);
    if (facet.loops.empty()) continue;
    facet.actor = index;
    facet.id = static_cast<int>(scene.facets.size());
    facet.present = actor.present;
    for (int t : members) actor.triangle_facet[t] = facet.id;
    actor.facets.push_back(facet.id);
    scene.facets.push_back(std::move(facet));
  }
  if (actor.facets.empty()) {
    throw InputError(scene.file + ": actor " + actor.name + " has no triangle with an area; remove or repair it");
  }
  findCurvedSurfaces(scene, index, mesh.weld);
  findClosedBodies(scene, index, mesh.weld);
}

}  // namespace

void rebuildFacets(Scene& scene) {
  scene.facets.clear();
  scene.curved.clear();
  scene.bodies.clear();
  scene.uncut.clear();
  for (std::size_t a = 0; a < scene.actors.size(); ++a) buildFacets(scene, static_cast<int>(a));
  relateFacets(scene);
}

void addActor(Scene& scene, Actor actor) {
  scene.actors.push_back(std::move(actor));
  buildFacets(scene, static_cast<int>(scene.actors.size()) - 1);
  relateFacets(scene);
}

void moveActor(Scene& scene, int index, const Eigen::Isometry3d& T) {
  Actor& actor = scene.actors.at(index);
  actor.bounds.setEmpty();
  for (auto& v : actor.vertices) {
    v = T * v;
    actor.bounds.extend(v);
  }
  for (int id : actor.facets) {
    Facet& f = scene.facets[id];
    f.origin = T * f.origin;
    f.e1 = T.linear() * f.e1;
    f.e2 = T.linear() * f.e2;
    f.normal = T.linear() * f.normal;
    f.reflects = std::abs(f.normal.z()) < std::sqrt(0.5);
  }
  for (CurvedSurface& s : scene.curved) {
    if (s.actor != index) continue;
    s.center = T * s.center;
    s.axis = T.linear() * s.axis;
  }
  relateFacets(scene);
}

void scaleScene(Scene& scene, double factor) {
  for (std::vector<Actor>* list : {&scene.actors, &scene.occluders_only}) {
    for (Actor& actor : *list) {
      actor.bounds.setEmpty();
      for (auto& v : actor.vertices) {
        v *= factor;
        actor.bounds.extend(v);
      }
      actor.T_map_mesh.translation() *= factor;
      actor.repeated_m2 *= factor * factor;
    }
  }
  const auto scaleLoops = [factor](std::vector<std::vector<Eigen::Vector2d>>& loops) {
    for (auto& loop : loops) {
      for (Eigen::Vector2d& p : loop) p *= factor;
    }
  };
  for (Facet& f : scene.facets) {
    f.origin *= factor;
    f.size1_m *= factor;
    f.size2_m *= factor;
    f.area_m2 *= factor * factor;
    f.flatness_m *= factor;
    scaleLoops(f.loops);
  }
  for (auto& [id, shape] : scene.uncut) {
    shape.area_m2 *= factor * factor;
    scaleLoops(shape.loops);
  }
  for (CurvedSurface& s : scene.curved) {
    s.center *= factor;
    s.length_m *= factor;
    s.radius_m *= factor;
    s.sagitta_m *= factor;
  }
  relateFacets(scene);
}

void removeActor(Scene& scene, int index) {
  scene.actors.at(index).present = false;
  for (int id : scene.actors[index].facets) scene.facets[id].present = false;
  relateFacets(scene);
}

}  // namespace mmradartwin
