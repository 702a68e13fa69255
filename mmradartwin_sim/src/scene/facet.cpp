#include <algorithm>
#include <cmath>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {
namespace {

double boundaryDistance(const Facet& facet, const Eigen::Vector2d& p, Eigen::Vector2d* foot, Eigen::Vector2d* inward) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& loop : facet.loops) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Eigen::Vector2d& a = loop[i];
      const Eigen::Vector2d edge = loop[(i + 1) % loop.size()] - a;
      const double length2 = edge.squaredNorm();
      if (length2 <= 0) continue;
      const double t = std::min(1.0, std::max(0.0, (p - a).dot(edge) / length2));
      const Eigen::Vector2d q = a + t * edge;
      const double d = (p - q).norm();
      if (d >= best) continue;
      best = d;
      if (foot) *foot = q;
      // The inside lies to the left of every edge; at a corner the mean of both normals would be better, but the
      // caller checks what it gets.
      if (inward) *inward = Eigen::Vector2d(-edge.y(), edge.x()) / std::sqrt(length2);
    }
  }
  return best;
}

bool insideLoops(const Facet& facet, const Eigen::Vector2d& p) {
  bool inside = false;
  for (const auto& loop : facet.loops) {
    for (std::size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++) {
      const Eigen::Vector2d &a = loop[i], &b = loop[j];
      if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x()) {
        inside = !inside;
      }
    }
  }
  return inside;
}

double clampInset(double x, double size, double inset) {
  if (size <= 2 * inset) return 0.5 * size;
  return std::min(size - inset, std::max(inset, x));
}

}  // namespace

bool Facet::contains(const Eigen::Vector3d& p_on_plane, double tolerance_m) const {
  const Eigen::Vector2d p((p_on_plane - origin).dot(e1), (p_on_plane - origin).dot(e2));
  if (p.x() < -tolerance_m || p.y() < -tolerance_m || p.x() > size1_m + tolerance_m || p.y() > size2_m + tolerance_m) {
    return false;
  }
  if (rectangle || insideLoops(*this, p)) return true;
  return tolerance_m > 0 && boundaryDistance(*this, p, nullptr, nullptr) <= tolerance_m;
}

Eigen::Vector3d Facet::nearest(const Eigen::Vector3d& p, double inset_m) const {
  Eigen::Vector2d q((p - origin).dot(e1), (p - origin).dot(e2));
  if (rectangle) {
    q = Eigen::Vector2d(clampInset(q.x(), size1_m, inset_m), clampInset(q.y(), size2_m, inset_m));
  } else {
    Eigen::Vector2d foot = q, inward(0, 0);
    const bool inside = insideLoops(*this, q);
    const double distance = boundaryDistance(*this, q, &foot, &inward);
    if (!inside || distance < inset_m) {
      // Straight on from p through its foot is inwards, at corners too; where p lies inside, away from the boundary.
      Eigen::Vector2d direction = inside ? Eigen::Vector2d(q - foot) : Eigen::Vector2d(foot - q);
      direction = direction.norm() > 1e-9 ? Eigen::Vector2d(direction.normalized()) : inward;
      q = foot;
      for (double step = inset_m; step > 1e-4 * inset_m && inset_m > 0; step /= 2) {
        bool done = false;
        for (const Eigen::Vector2d& d : {direction, inward}) {
          if (insideLoops(*this, foot + step * d)) {
            q = foot + step * d;
            done = true;
            break;
          }
        }
        if (done) break;
      }
    }
  }
  return origin + q.x() * e1 + q.y() * e2;
}

}  // namespace mmradartwin
