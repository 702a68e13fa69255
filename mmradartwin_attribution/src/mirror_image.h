#pragma once

#include <vector>

#include "mmradartwin_sim/ray_caster.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// A closed path from a point over several facets back to the point, with every facet as a mirror: geometry alone.
struct MirrorImage {
  std::vector<int> facets;                ///< in the order of travel, two or three
  std::vector<Eigen::Vector3d> vertices;  ///< map, one per facet
  double length_m = 0;
  double aperture = 0;  ///< product of the facets' Fresnel aperture factors, 1 for unbounded planes
};

/// Finds the images of a point in two and three facets. find() is const and thread-safe.
class MirrorSearch {
 public:
  /// Keeps references to scene and rays.
  MirrorSearch(const Scene& scene, const RayCaster& rays, double wavelength_m);
  /// Paths over two to `max_order` mirrors (2 or 3), at most max_length_m long. Their first and last leg leave the
  /// radar ahead of it and within max_elevation_rad of its horizontal plane. Pairs of perpendicular facets are left
  /// out: their image is the corner's.
  std::vector<MirrorImage> find(const Eigen::Isometry3d& T_map_radar, int max_order, double max_length_m,
                                double max_elevation_rad) const;

 private:
  struct Mirror {
    const Facet* facet;
    Eigen::Matrix<double, 3, 4> corners;
  };
  const Scene& scene_;
  const RayCaster& rays_;
  double wavelength_m_;
  std::vector<Mirror> mirrors_;
};

}  // namespace mmradartwin
