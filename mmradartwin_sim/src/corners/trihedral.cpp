#include "corners/trihedral.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "physics/aperture.h"
#include "physics/polarisation.h"

namespace mmradartwin {
namespace {

using Polygon = std::vector<Eigen::Vector2d>;

constexpr double kSmallestTrihedralFactor = 0.01;
constexpr double kSmallestFace_m2 = 1e-6;

double signedArea(const Polygon& polygon) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * sum;
}

/// The part of a polygon where normal . p >= 0 (Sutherland and Hodgman).
Polygon clip(const Polygon& polygon, const Eigen::Vector2d& point, const Eigen::Vector2d& normal) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double ha = (a - point).dot(normal), hb = (b - point).dot(normal);
    if (ha >= 0) kept.push_back(a);
    if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) kept.push_back(a + ha / (ha - hb) * (b - a));
  }
  return kept;
}

/// Intersection with a convex, counter-clockwise polygon.
Polygon intersection(Polygon polygon, const Polygon& convex) {
  for (std::size_t i = 0; i < convex.size() && !polygon.empty(); ++i) {
    const Eigen::Vector2d along = convex[(i + 1) % convex.size()] - convex[i];
    if (along.squaredNorm() < 1e-24) continue;
    polygon = clip(polygon, convex[i], Eigen::Vector2d(-along.y(), along.x()));
  }
  return polygon;
}

bool meetPlanes(const Scene& scene, const std::array<int, 3>& ids, Eigen::Vector3d& apex) {
  Eigen::Matrix3d normals;
  Eigen::Vector3d offsets;
  const Eigen::Vector3d near = scene.facets[ids[0]].origin;  // keeps numbers small
  for (int i = 0; i < 3; ++i) {
    const Facet& f = scene.facets[ids[i]];
    normals.row(i) = f.normal.transpose();
    offsets[i] = f.normal.dot(f.origin - near);
  }
  if (std::abs(normals.determinant()) < 0.9) return false;
  apex = near + normals.inverse() * offsets;
  return apex.allFinite();
}

}  // namespace

std::vector<Trihedral> findTrihedra(const Scene& scene, const std::vector<CornerEdge>& edges, double meet_m) {
  std::map<int, std::set<int>> above;  // facet -> facets of higher id that it has an edge with
  for (const CornerEdge& e : edges) above[e.a].insert(e.b);
  std::vector<Trihedral> found;
  for (const auto& [a, neighbours] : above) {
    for (auto b = neighbours.begin(); b != neighbours.end(); ++b) {
      const auto of_b = above.find(*b);
      if (of_b == above.end()) continue;
      for (auto c = std::next(b); c != neighbours.end(); ++c) {
        if (of_b->second.count(*c) == 0) continue;
        Trihedral t;
        t.facets = {a, *b, *c};
        if (!meetPlanes(scene, t.facets, t.apex)) continue;
        for (int octant = 0; octant < 8; ++octant) {
          for (int i = 0; i < 3; ++i) t.edge[i] = (octant >> i & 1 ? -1.0 : 1.0) * scene.facets[t.facets[i]].normal;
          bool whole = true;
          for (int i = 0; i < 3 && whole; ++i) {
            const Facet& f = scene.facets[t.facets[i]];
            const Eigen::Vector3d &u = t.edge[(i + 1) % 3], &v = t.edge[(i + 2) % 3];
            Polygon face;
            const auto& loops = f.loops;
            const auto outer = std::max_element(loops.begin(), loops.end(), [](const Polygon& p, const Polygon& q) {
              return signedArea(p) < signedArea(q);
            });
            for (const Eigen::Vector2d& q : *outer) {
              const Eigen::Vector3d p = f.origin + q.x() * f.e1 + q.y() * f.e2 - t.apex;
              face.emplace_back(p.dot(u), p.dot(v));
            }
            face = clip(clip(face, {0, 0}, {1, 0}), {0, 0}, {0, 1});
            whole = std::abs(signedArea(face)) > kSmallestFace_m2 &&
                    std::any_of(face.begin(), face.end(),
                                [&](const Eigen::Vector2d& q) { return q.norm() <= 1.5 * meet_m; });
            t.outline[i].clear();
            for (const Eigen::Vector2d& q : face) t.outline[i].push_back(q.x() * u + q.y() * v);
          }
          if (whole) found.push_back(t);
        }
      }
    }
  }
  return found;
}

void addTrihedralPath(const PoseContext& context, const ElementsInMap& elements, const Trihedral& trihedral,
                      const PathEvent& event, std::vector<PathRecord>& records) {
  const Eigen::Vector3d to_radar = elements.p - trihedral.apex;
  for (const Eigen::Vector3d& e : trihedral.edge) {
    if (to_radar.dot(e) < 1e-6) return;
  }
  const double R = to_radar.norm();
  if (R > context.max_range_m) return;
  const Eigen::Vector3d out = -to_radar / R, direction_radar = context.T_map_radar.linear().transpose() * out;
  if (!context.inFieldOfView(direction_radar)) return;

  const double wavelength = context.radar.wavelength_m(), unit = 2 / std::sqrt(wavelength * R);
  const Eigen::Vector3d across = out.unitOrthogonal(), other = out.cross(across);
  std::array<Polygon, 3> face, inverted;
  for (int i = 0; i < 3; ++i) {
    for (const Eigen::Vector3d& q : trihedral.outline[i]) {
      face[i].emplace_back(unit * q.dot(across), unit * q.dot(other));
    }
    if (signedArea(face[i]) < 0) std::reverse(face[i].begin(), face[i].end());
    for (const Eigen::Vector2d& q : face[i]) inverted[i].push_back(-q);
  }
  std::vector<Polygon> parts;
  for (const Polygon& f : face) {
    for (const Polygon& g : inverted) {
      Polygon part = intersection(f, g);
      if (part.size() >= 3 && signedArea(part) > 0) parts.push_back(std::move(part));
    }
  }
  const std::complex<double> factor = aperturePolygon(parts);
  if (std::abs(factor) < kSmallestTrihedralFactor) return;
  for (int id : trihedral.facets) {
    if (!elements.sides.isOpen(context.scene.facets[id], trihedral.apex, elements.p)) return;
  }
  const Eigen::Vector3d lifted =
      trihedral.apex + 2 * kFacesMeet_m * (trihedral.edge[0] + trihedral.edge[1] + trihedral.edge[2]);
  if (!context.rays.visible(elements.p, lifted, 1e-3)) return;

  const Eigen::Vector3d e = verticalField(elements.up, out);
  std::array<int, 3> order = {0, 1, 2};
  std::complex<double> gamma = 0;
  int orders = 0;
  do {
    ComplexVector field = e.cast<std::complex<double>>();
    Eigen::Vector3d in = out;
    for (int i : order) {
      const Facet& f = context.scene.facets[trihedral.facets[i]];
      field = reflectField(field, in, f.normal, context.scene.actors[f.actor].material, context.frequency_hz);
      in -= 2 * in.dot(f.normal) * f.normal;
    }
    gamma += (e.cast<std::complex<double>>().transpose() * field)(0);
    ++orders;
  } while (std::next_permutation(order.begin(), order.end()));
  gamma /= orders;

  PathRecord record;
  std::complex<double> coefficient = event.level * wavelength / (4 * M_PI * 2 * R) * gamma * factor;
  for (int id : trihedral.facets) {
    const Facet& f = context.scene.facets[id];
    coefficient *= specularShare(context.scene.actors[f.actor].material);
    record.actors.push_back(f.actor);
    record.facets.push_back(id);
    record.vertices.push_back(trihedral.apex);
    record.reflection_cosine.push_back(std::abs(out.dot(f.normal)));
  }
  if (!(std::abs(coefficient) > 0)) return;
  record.event = &event.name;
  record.departure = record.arrival = direction_radar;
  record.bounces = 3;
  record.length_m =
      elements.lengthsByImage([&](const Eigen::Vector3d& t) -> Eigen::Vector3d { return 2 * trihedral.apex - t; });
  setContribution(context.radar, std::conj(coefficient), record);
  records.push_back(std::move(record));
}

}  // namespace mmradartwin
