#include "scene/closed_body.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace mmradartwin {
namespace {

using Index3 = std::array<int, 3>;

constexpr int kNoSide = 2;
constexpr double kLeastThickness_m = 1e-6;  // volume over half the surface: less is a sheet

/// Triangles of an actor by welded vertices, without those that are left out.
struct Surface {
  std::vector<Index3> corners;
  std::vector<int> facet;  // -1 where the triangle has no area
};

bool hasArea(const Actor& actor, std::size_t triangle) {
  const auto vertex = [&](int k) { return actor.vertices[static_cast<std::size_t>(actor.triangles[triangle][k])]; };
  return (vertex(1) - vertex(0)).cross(vertex(2) - vertex(0)).norm() > 2e-12;
}

Surface surfaceOf(const Actor& actor, const std::vector<int>& weld) {
  Surface surface;
  for (std::size_t t = 0; t < actor.triangles.size(); ++t) {
    Index3 w;
    for (int k = 0; k < 3; ++k) w[k] = weld[static_cast<std::size_t>(actor.triangles[t][k])];
    if (w[0] == w[1] || w[1] == w[2] || w[2] == w[0]) continue;
    if (actor.triangle_facet[t] < 0 && hasArea(actor, t)) continue;  // it lies on others
    surface.corners.push_back(w);
    surface.facet.push_back(actor.triangle_facet[t]);
  }
  return surface;
}

/// Parts that hang together over edges of two triangles, turned so that neighbours wind alike; empty where a part has
/// an edge of one triangle or of more than two, or cannot be turned so.
class Parts {
 public:
  explicit Parts(Surface& surface) : surface_(surface), part_(surface.corners.size(), -1) {
    for (std::size_t t = 0; t < surface.corners.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const int a = surface.corners[t][k], b = surface.corners[t][(k + 1) % 3];
        sides_.push_back({std::min(a, b), std::max(a, b), static_cast<int>(t)});
      }
    }
    std::sort(sides_.begin(), sides_.end());
  }

  std::vector<std::vector<int>> closed() {
    std::vector<std::vector<int>> found;
    for (std::size_t t = 0; t < part_.size(); ++t) {
      if (part_[t] >= 0) continue;
      std::vector<int> members = {static_cast<int>(t)};
      part_[t] = 1;
      bool whole = true;
      for (std::size_t i = 0; i < members.size(); ++i) whole = visit(members[i], members) && whole;
      if (whole) found.push_back(std::move(members));
    }
    return found;
  }

 private:
  using Side = std::tuple<int, int, int>;  // vertices, the lower first; triangle

  bool runs(int triangle, int a, int b) const {
    const Index3& c = surface_.corners[static_cast<std::size_t>(triangle)];
    for (int k = 0; k < 3; ++k) {
      if (c[k] == a && c[(k + 1) % 3] == b) return true;
    }
    return false;
  }

  bool visit(int triangle, std::vector<int>& members) {
    bool whole = true;
    const Index3 corners = surface_.corners[static_cast<std::size_t>(triangle)];
    for (int k = 0; k < 3; ++k) {
      const int a = corners[k], b = corners[(k + 1) % 3];
      const auto first = std::lower_bound(sides_.begin(), sides_.end(), Side(std::min(a, b), std::max(a, b), -1));
      auto end = first;
      while (end != sides_.end() && std::get<0>(*end) == std::get<0>(*first) &&
             std::get<1>(*end) == std::get<1>(*first))
        ++end;
      if (end - first != 2) {
        whole = false;
        continue;
      }
      const int other = std::get<2>(*first) == triangle ? std::get<2>(*std::next(first)) : std::get<2>(*first);
      const bool against = runs(other, b, a);
      if (part_[static_cast<std::size_t>(other)] < 0) {
        part_[static_cast<std::size_t>(other)] = 1;
        Index3& turned = surface_.corners[static_cast<std::size_t>(other)];
        if (!against) std::swap(turned[1], turned[2]);
        members.push_back(other);
      } else if (!against) {
        whole = false;
      }
    }
    return whole;
  }

  Surface& surface_;
  std::vector<int> part_;  // -1 where it was not reached yet
  std::vector<Side> sides_;
};

/// Six volumes and twice the area of triangles, about a vertex of theirs so that no digits are lost.
std::pair<double, double> measure(const Actor& actor, const Surface& surface, const std::vector<int>& members) {
  const auto vertex = [&](int triangle, int k) -> const Eigen::Vector3d& {
    return actor.vertices[static_cast<std::size_t>(surface.corners[static_cast<std::size_t>(triangle)][k])];
  };
  const Eigen::Vector3d origin = vertex(members.front(), 0);
  double volume = 0, area = 0;
  for (int t : members) {
    const Eigen::Vector3d a = vertex(t, 0) - origin, b = vertex(t, 1) - origin, c = vertex(t, 2) - origin;
    volume += a.dot(b.cross(c));
    area += (b - a).cross(c - a).norm();
  }
  return {volume, area};
}

}  // namespace

void findClosedBodies(Scene& scene, int index, const std::vector<int>& weld) {
  const Actor& actor = scene.actors[static_cast<std::size_t>(index)];
  Surface surface = surfaceOf(actor, weld);
  std::vector<char> closed(surface.corners.size(), 0);
  for (const std::vector<int>& members : Parts(surface).closed()) {
    const auto [volume, area] = measure(actor, surface, members);
    if (std::abs(volume) / 6 < kLeastThickness_m * area / 4) continue;
    const auto id = static_cast<int>(scene.bodies.size());
    ClosedBody body;
    body.actor = index;
    for (int t : members) {
      closed[static_cast<std::size_t>(t)] = 1;
      Index3 corners = surface.corners[static_cast<std::size_t>(t)];
      if (volume < 0) std::swap(corners[1], corners[2]);
      body.triangles.push_back(corners);
      const int facet_id = surface.facet[static_cast<std::size_t>(t)];
      if (facet_id < 0) continue;
      Facet& facet = scene.facets[static_cast<std::size_t>(facet_id)];
      const Eigen::Vector3d &a = actor.vertices[static_cast<std::size_t>(corners[0])],
                            &b = actor.vertices[static_cast<std::size_t>(corners[1])],
                            &c = actor.vertices[static_cast<std::size_t>(corners[2])];
      const int outside = facet.normal.dot((b - a).cross(c - a)) > 0 ? 1 : -1;
      // A facet of two bodies, of a body and a sheet, or folded onto itself has no side of its own.
      const bool first = facet.body < 0 && facet.outside == 0;
      facet.outside = first || (facet.body == id && facet.outside == outside) ? outside : kNoSide;
      facet.body = id;
    }
    scene.bodies.push_back(std::move(body));
  }
  for (std::size_t t = 0; t < closed.size(); ++t) {
    if (!closed[t] && surface.facet[t] >= 0) scene.facets[static_cast<std::size_t>(surface.facet[t])].outside = kNoSide;
  }
  for (int id : actor.facets) {
    Facet& facet = scene.facets[static_cast<std::size_t>(id)];
    if (facet.outside != kNoSide) continue;
    facet.outside = 0;
    facet.body = -1;
  }
}

}  // namespace mmradartwin
