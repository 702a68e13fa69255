#pragma once

#include <Eigen/Geometry>
#include <complex>
#include <optional>

#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/pose_context.h"
#include "mmradartwin_sim/scene.h"
#include "physics/elements_in_map.h"

namespace mmradartwin {

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
