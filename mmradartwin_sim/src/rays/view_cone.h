#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace mmradartwin {

/// Cones about boxes as seen from a point: a quick answer for the many ways from it that pass them all.
class ViewCones {
 public:
  ViewCones(const Eigen::Vector3d& eye, const std::vector<Eigen::AlignedBox3d>& boxes) {
    for (const Eigen::AlignedBox3d& box : boxes) {
      const Eigen::Vector3d way = box.center() - eye;
      const double square = way.squaredNorm(), radius2 = 0.25 * box.diagonal().squaredNorm();
      if (!(square > radius2)) {
        within_ = true;
      } else {
        cones_.push_back({way / std::sqrt(square), 1 - radius2 / square});
      }
    }
  }
  /// False where no ray from the eye along `way`, however long, comes into a box.
  bool mayMeet(const Eigen::Vector3d& way) const {
    if (within_) return true;
    const double square = way.squaredNorm() * (1 - 1e-9);
    for (const Cone& c : cones_) {
      const double along = c.axis.dot(way);
      if (along >= 0 && along * along >= c.cosine2 * square) return true;
    }
    return false;
  }

 private:
  struct Cone {
    Eigen::Vector3d axis;  // unit
    double cosine2;        // of half the opening
  };
  std::vector<Cone> cones_;
  bool within_ = false;
};

}  // namespace mmradartwin
