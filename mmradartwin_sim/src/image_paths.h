#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <string>
#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

inline Eigen::Vector3d mirror(const Eigen::Vector3d& p, const Facet& facet) {
  return p - 2 * facet.planeDistance(p) * facet.normal;
}

/// A closed specular path from a point back to it.
struct ImagePath {
  std::vector<int> facets;  ///< in the order in which they are met
  std::vector<Eigen::Vector3d> vertices;
  Eigen::Vector3d image;  ///< of the point through all facets; the path is as long as it is far
};

/// Exhaustive image search over a scene's facets; what depends on the scene alone is computed once.
class ImageSearch {
 public:
  /// all_orientations: facets near the horizontal reflect too (the closed form of a box room).
  explicit ImageSearch(const Scene& scene, bool all_orientations = false);

  struct Limits {
    int max_order = 3;
    double max_length_m = 1e9;
    /// Directions (map, from the point outwards) in which the radar sends and receives; empty: all.
    std::function<bool(const Eigen::Vector3d&)> in_view;
    /// Half space of in_view, for pruning: unit vector, or zero.
    Eigen::Vector3d forward = Eigen::Vector3d::Zero();
  };
  /// Paths of order min_order..max_order whose reflection points lie inside their facets and whose legs are all free.
  /// Each facet sequence once; two sequences of the same facets with the same image once; perpendicular pairs at
  /// order 2 not at all (they are the corner's).
  std::vector<ImagePath> find(const Eigen::Vector3d& p, const RayCaster& rays, const Limits& limits,
                              int min_order = 1) const;

  /// The path of one facet sequence, where it exists.
  bool solve(const Eigen::Vector3d& p, const std::vector<int>& sequence, const RayCaster& rays, const Limits& limits,
             ImagePath& path) const;
  struct Seed {
    std::vector<int> facets;
    bool by_half;  ///< every second ray would have been enough to find it
  };
  /// Facet sequences that launched rays meet, up to max_order: seeds where there are too many facets to try all.
  std::vector<Seed> seeds(const Eigen::Vector3d& p, const RayCaster& rays, const Limits& limits, int rays_launched,
                          const Eigen::Matrix3d& R_map_radar, double max_elevation_rad) const;

  /// Highest order for which all sequences can be tried at this number of facets.
  int exhaustiveOrder() const;
  const std::vector<int>& reflectors() const { return reflectors_; }

 private:
  struct Corners {
    Eigen::Matrix<double, 3, 4> point;
  };
  bool faces(int a, bool positive_side, int b) const;  // b has a part on that side of a
  bool insideBeam(const Eigen::Vector3d& apex, int through, int target) const;

  const Scene& scene_;
  std::vector<int> reflectors_;   // facet ids
  std::vector<Corners> corners_;  // per reflector, of the bounding rectangle
  struct Plane {
    Eigen::Vector3d normal, origin;
  };
  std::vector<Plane> planes_;  // per reflector
  // [2 * reflector + side]: reflectors with a part on that side of it, 1 where its normal points. Empty where there are
  // too many for three bounces.
  std::vector<std::vector<int>> on_side_;
};

/// True for facets that are perpendicular within 0.1 deg: the corner's domain.
inline bool perpendicular(const Facet& a, const Facet& b) { return std::abs(a.normal.dot(b.normal)) < 1.745e-3; }

}  // namespace mmradartwin
