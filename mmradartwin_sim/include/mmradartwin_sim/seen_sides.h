#pragma once

#include <Eigen/Core>
#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// Which side of a facet paths of one radar can meet, however thin the body is that the facet bounds: a free way stays
/// outside of closed bodies, or within those that the radar is in, and never passes a layer that lies over the facet.
/// Rays that end millimetres short of what they go to do not tell. Not for several threads at once.
class SeenSides {
 public:
  SeenSides(const Scene& scene, const Eigen::Vector3d& radar);
  /// False where the facet's side towards a point is within a body that the radar is not in, or the reverse.
  bool shows(const Facet& facet, const Eigen::Vector3d& towards) const;
  /// shows(), and no layer over the facet lies between a point of it and one towards which a way leads from there.
  bool isOpen(const Facet& facet, const Eigen::Vector3d& point, const Eigen::Vector3d& towards) const;

 private:
  const Scene& scene_;
  Eigen::Vector3d radar_;
  mutable std::vector<signed char> holds_radar_;  // [body], -1 where it was not asked for yet
};

/// True where a point lies within a closed body.
bool isWithin(const Scene& scene, const ClosedBody& body, const Eigen::Vector3d& point);

}  // namespace mmradartwin
