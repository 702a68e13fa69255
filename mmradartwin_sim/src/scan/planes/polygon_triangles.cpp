#include "scan/planes/polygon_triangles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace mmradartwin {
namespace {

double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

class EarClipping {
 public:
  EarClipping(const std::vector<Eigen::Vector2d>& outline, const std::vector<std::vector<Eigen::Vector2d>>& holes) {
    points_ = outline;
    ring_.resize(outline.size());
    std::iota(ring_.begin(), ring_.end(), 0);
    std::vector<std::vector<int>> loops;
    for (const auto& hole : holes) {
      std::vector<int> loop;
      for (const Eigen::Vector2d& p : hole) loop.push_back(static_cast<int>(points_.size())), points_.push_back(p);
      loops.push_back(loop);
    }
    // The hole that reaches farthest to the right first: nothing but the ring lies to its right.
    const auto rightmost = [this](const std::vector<int>& loop) {
      return *std::max_element(loop.begin(), loop.end(), [this](int a, int b) { return at(a).x() < at(b).x(); });
    };
    std::sort(loops.begin(), loops.end(), [&](const std::vector<int>& a, const std::vector<int>& b) {
      return at(rightmost(a)).x() > at(rightmost(b)).x();
    });
    for (std::vector<int>& loop : loops) {
      std::rotate(loop.begin(), std::find(loop.begin(), loop.end(), rightmost(loop)), loop.end());
      join(loop);
    }
  }

  std::vector<std::array<int, 3>> run() {
    std::vector<std::array<int, 3>> triangles;
    while (ring_.size() >= 3) {
      const int ear = bestEar();
      if (ear < 0) break;
      const auto i = static_cast<std::size_t>(ear);
      const int a = ring_[(i + ring_.size() - 1) % ring_.size()], b = ring_[i], c = ring_[(i + 1) % ring_.size()];
      if (turn(at(a), at(b), at(c)) > 0) triangles.push_back({a, b, c});
      ring_.erase(ring_.begin() + ear);
    }
    return triangles;
  }

 private:
  const Eigen::Vector2d& at(int i) const { return points_[static_cast<std::size_t>(i)]; }

  bool crosses(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const {
    for (std::size_t i = 0; i < ring_.size(); ++i) {
      const Eigen::Vector2d &c = at(ring_[i]), &d = at(ring_[(i + 1) % ring_.size()]);
      if (c == a || c == b || d == a || d == b) continue;
      if (turn(a, b, c) * turn(a, b, d) <= 0 && turn(c, d, a) * turn(c, d, b) <= 0) return true;
    }
    return false;
  }

  /// Joins a hole to the nearest corner of the ring that its first corner sees.
  void join(const std::vector<int>& loop) {
    std::size_t best = ring_.size();
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < ring_.size(); ++i) {
      const double distance = (at(ring_[i]) - at(loop[0])).squaredNorm();
      if (distance < nearest && !crosses(at(loop[0]), at(ring_[i])) && opensTo(i, at(loop[0])))
        nearest = distance, best = i;
    }
    if (best == ring_.size()) return;
    std::vector<int> bridge = loop;
    bridge.push_back(loop[0]);
    bridge.push_back(ring_[best]);
    ring_.insert(ring_.begin() + static_cast<std::ptrdiff_t>(best) + 1, bridge.begin(), bridge.end());
  }

  /// The inside of the ring at a corner is seen from p: of two corners at one place, only one is.
  bool opensTo(std::size_t i, const Eigen::Vector2d& p) const {
    const Eigen::Vector2d &a = at(ring_[(i + ring_.size() - 1) % ring_.size()]), &b = at(ring_[i]),
                          &c = at(ring_[(i + 1) % ring_.size()]);
    if (turn(a, b, c) >= 0) return turn(a, b, p) >= 0 && turn(b, c, p) >= 0;
    return turn(a, b, p) >= 0 || turn(b, c, p) >= 0;
  }

  /// The ear whose smallest angle is largest, so that no slivers arise where others will do.
  int bestEar() const {
    int best = -1;
    double best_shape = -1;
    for (std::size_t i = 0; i < ring_.size(); ++i) {
      const Eigen::Vector2d &a = at(ring_[(i + ring_.size() - 1) % ring_.size()]), &b = at(ring_[i]),
                            &c = at(ring_[(i + 1) % ring_.size()]);
      const double doubled = turn(a, b, c);
      if (doubled < 0) continue;
      const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
      const double shape = longest > 0 ? doubled / longest : 1;
      if (shape <= best_shape) continue;
      bool empty = true;
      for (std::size_t k = 0; k < ring_.size() && empty; ++k) {
        const Eigen::Vector2d& p = at(ring_[k]);
        if (p == a || p == b || p == c) continue;
        empty = turn(a, b, p) < 0 || turn(b, c, p) < 0 || turn(c, a, p) < 0;
        if (!empty && doubled == 0) empty = true;
      }
      if (empty) best = static_cast<int>(i), best_shape = shape;
    }
    return best;
  }

  std::vector<Eigen::Vector2d> points_;
  std::vector<int> ring_;
};

}  // namespace

double signedAreaOf(const std::vector<Eigen::Vector2d>& loop) {
  double sum = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d a = loop[i] - loop[0], b = loop[(i + 1) % loop.size()] - loop[0];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * sum;
}

std::vector<std::array<int, 3>> trianglesOf(const std::vector<Eigen::Vector2d>& outline,
                                            const std::vector<std::vector<Eigen::Vector2d>>& holes) {
  if (outline.size() < 3 || signedAreaOf(outline) <= 0) return {};
  return EarClipping(outline, holes).run();
}

}  // namespace mmradartwin
