#include "scene/curved_surface.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

namespace mmradartwin {
namespace {

constexpr double kLargestFold_deg = 32;
constexpr double kSmallestArc_deg = 60;
constexpr double kRelativeMisfit = 0.005, kLargestMisfit_m = 0.005;  // of a vertex, of the radius and at all
constexpr std::size_t kFewestSides = 5, kFewestFacesOfASphere = 20;

int root(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

/// Centre and radius of the sphere (d = 3) or circle (d = 2) nearest to some points, algebraically:
/// |p|^2 = 2 c.p + (r^2 - |c|^2). False where they do not determine one or stray from it.
template <int D>
bool fitRound(const std::vector<Eigen::Matrix<double, D, 1>>& points, Eigen::Matrix<double, D, 1>& center,
              double& radius) {
  if (points.size() < D + 2) return false;
  Eigen::Matrix<double, D, 1> mean = Eigen::Matrix<double, D, 1>::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix<double, D + 1, D + 1> A = Eigen::Matrix<double, D + 1, D + 1>::Zero();
  Eigen::Matrix<double, D + 1, 1> b = Eigen::Matrix<double, D + 1, 1>::Zero();
  for (const auto& p : points) {
    Eigen::Matrix<double, D + 1, 1> row;
    row << 2 * (p - mean), 1;
    A += row * row.transpose();
    b += row * (p - mean).squaredNorm();
  }
  const Eigen::Matrix<double, D + 1, 1> x = A.ldlt().solve(b);
  if (!x.allFinite()) return false;
  const double square = x[D] + x.template head<D>().squaredNorm();
  if (!(square > 0)) return false;
  center = mean + x.template head<D>();
  radius = std::sqrt(square);
  const double limit = std::min(kLargestMisfit_m, kRelativeMisfit * radius);
  return std::all_of(points.begin(), points.end(),
                     [&](const auto& p) { return std::abs((p - center).norm() - radius) < limit; });
}

std::optional<CurvedSurface> fit(const Scene& scene, const Actor& actor, const std::vector<int>& weld,
                                 const std::vector<int>& part) {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<char> wanted(scene.facets.size() - static_cast<std::size_t>(actor.facets.front()), 0);
  for (int id : part) wanted[static_cast<std::size_t>(id - actor.facets.front())] = 1;
  std::vector<int> used;
  for (std::size_t t = 0; t < actor.triangles.size(); ++t) {
    const int id = actor.triangle_facet[t];
    if (id < 0 || !wanted[static_cast<std::size_t>(id - actor.facets.front())]) continue;
    for (int v : actor.triangles[t]) used.push_back(weld[v]);
  }
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (int v : used) vertices.push_back(actor.vertices[v]);

  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (int id : part)
    spread += scene.facets[id].area_m2 * scene.facets[id].normal * scene.facets[id].normal.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  CurvedSurface s;
  s.actor = scene.facets[part.front()].actor;
  s.facets = part;
  s.axis = axes.eigenvectors().col(0);
  const bool straight = std::all_of(part.begin(), part.end(),
                                    [&](int id) { return std::abs(scene.facets[id].normal.dot(s.axis)) < 0.01; });
  double arc = 1;
  for (int i : part) arc = std::min(arc, std::abs(scene.facets[i].normal.dot(scene.facets[part.front()].normal)));
  if (arc > std::cos(0.5 * kSmallestArc_deg * M_PI / 180)) return std::nullopt;
  if (straight) {
    const Eigen::Vector3d u = s.axis.unitOrthogonal(), v = s.axis.cross(u);
    std::vector<Eigen::Vector2d> flat;
    double low = 1e300, high = -1e300;
    for (const auto& p : vertices) {
      flat.emplace_back(p.dot(u), p.dot(v));
      low = std::min(low, p.dot(s.axis));
      high = std::max(high, p.dot(s.axis));
    }
    Eigen::Vector2d c;
    if (!fitRound<2>(flat, c, s.radius_m)) return std::nullopt;
    s.center = c.x() * u + c.y() * v + low * s.axis;
    s.length_m = high - low;
  } else {
    s.sphere = true;
    if (part.size() < kFewestFacesOfASphere || !fitRound<3>(vertices, s.center, s.radius_m)) return std::nullopt;
  }
  // Facets have to be chords: their normals point from the centre or axis.
  for (int id : part) {
    const Facet& f = scene.facets[id];
    Eigen::Vector3d way = f.origin + 0.5 * (f.size1_m * f.e1 + f.size2_m * f.e2) - s.center;
    if (!s.sphere) way -= way.dot(s.axis) * s.axis;
    const double depth = std::abs(way.dot(f.normal));
    if (depth < std::cos(0.5 * kLargestFold_deg * M_PI / 180) * way.norm()) return std::nullopt;
    s.sagitta_m = std::max(s.sagitta_m, s.radius_m - depth);
  }
  if (s.sagitta_m > (1 - std::cos(0.5 * kLargestFold_deg * M_PI / 180)) * s.radius_m) return std::nullopt;
  return s;
}

}  // namespace

std::vector<std::vector<int>> smoothParts(const Scene& scene, const Actor& actor, const std::vector<int>& weld) {
  const int first = actor.facets.front();
  std::vector<std::array<int, 3>> sides;  // two vertices and the facet
  for (std::size_t t = 0; t < actor.triangles.size(); ++t) {
    if (actor.triangle_facet[t] < 0) continue;
    for (int k = 0; k < 3; ++k) {
      const int a = weld[actor.triangles[t][k]], b = weld[actor.triangles[t][(k + 1) % 3]];
      sides.push_back({std::min(a, b), std::max(a, b), actor.triangle_facet[t] - first});
    }
  }
  std::sort(sides.begin(), sides.end());
  std::vector<int> parent(actor.facets.size());
  std::iota(parent.begin(), parent.end(), 0);
  const double cosine = std::cos(kLargestFold_deg * M_PI / 180);
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    const auto &p = sides[i], &q = sides[i + 1];
    if (p[0] != q[0] || p[1] != q[1] || p[2] == q[2]) continue;
    const Eigen::Vector3d &m = scene.facets[first + p[2]].normal, &n = scene.facets[first + q[2]].normal;
    if (std::abs(m.dot(n)) > cosine) parent[root(parent, p[2])] = root(parent, q[2]);
  }
  std::map<int, std::vector<int>> parts;
  for (std::size_t i = 0; i < parent.size(); ++i) parts[root(parent, static_cast<int>(i))].push_back(first + int(i));
  std::vector<std::vector<int>> result;
  for (auto& [r, part] : parts) {
    if (part.size() >= kFewestSides) result.push_back(std::move(part));
  }
  return result;
}

void findCurvedSurfaces(Scene& scene, int index, const std::vector<int>& weld) {
  const Actor& actor = scene.actors[index];
  if (actor.facets.size() < kFewestSides) return;
  for (const std::vector<int>& part : smoothParts(scene, actor, weld)) {
    const std::optional<CurvedSurface> surface = fit(scene, actor, weld, part);
    if (!surface) continue;
    for (int id : part) scene.facets[id].curved = static_cast<int>(scene.curved.size());
    scene.curved.push_back(*surface);
  }
}

}  // namespace mmradartwin
