#pragma once

#include <Eigen/Geometry>
#include <complex>
#include <optional>
#include <vector>

#include "physics/elements_in_map.h"

namespace mmradartwin {

/// Facets of an actor, five and more, that folds of less than 32 deg join: ids. weld: as below.
std::vector<std::vector<int>> smoothParts(const Scene& scene, const Actor& actor, const std::vector<int>& weld);

/// Spheres and straight circular cylinders that tessellated parts of an actor stand for: facets joined by folds of less
/// than 32 deg (12 sides and more) whose vertices lie on one such surface, over an arc of 60 deg and more. weld: the
/// actor's vertices, each by the first at its place. Sets Facet::curved of what was found.
void findCurvedSurfaces(Scene& scene, int actor, const std::vector<int>& weld);

/// First-order echo of a curved surface, without its material and without asking whether anything is in its way.
struct CurvedEcho {
  Eigen::Vector3d vertex;
  Eigen::Vector3d direction;        ///< unit, in map, towards the vertex
  Eigen::Vector3d direction_radar;  ///< the same in radar_link
  Eigen::Vector3d straight;         ///< unit, in map, along the surface's normal through the radar
  double distance_m;
  /// lambda/(8 pi R), R the perpendicular distance, times the divergence r/(r+R) of a sphere, sqrt(r/(r+R)) of a
  /// cylinder, and its Fresnel aperture along the axis: far off pi r^2 and 2 pi r L^2/lambda.
  std::complex<double> coefficient;
  PerChannel<double> length_m;  ///< per virtual element
};
/// None from inside, out of range or view, or where the aperture leaves less than 0.01. Beside a cylinder's ends the
/// echo comes from 1 cm inside, as beside a facet.
std::optional<CurvedEcho> curvedEcho(const PoseContext& context, const ElementsInMap& elements,
                                     const CurvedSurface& surface);

}  // namespace mmradartwin
