#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "corners/corner_edge.h"
#include "physics/path_event.h"

namespace mmradartwin {

/// Three facets that meet concavely in one point, each at right angles to the others: they fill an octant's corner.
struct Trihedral {
  std::array<int, 3> facets;  ///< ids, rising
  Eigen::Vector3d apex;
  std::array<Eigen::Vector3d, 3> edge;  ///< unit, along the octant's edges; edge[i] is across facet i
  /// The part of each facet in the octant, from the apex; taken as convex, without its holes.
  std::array<std::vector<Eigen::Vector3d>, 3> outline;
};

/// Trihedra whose three pairs are all among the edges (findCornerEdges). Faces meet that come within meet_m of the
/// apex.
std::vector<Trihedral> findTrihedra(const Scene& scene, const std::vector<CornerEdge>& edges, double meet_m);

/// The retro path of three bounces, by way of the apex, whose point inversion is the image: level of the image at the
/// apex's distance times the Fresnel aperture factor of the effective aperture. That is the faces' outline across the
/// ray, in so far as it covers its own inversion (a ray that comes in beside the apex leaves on the opposite side): at
/// boresight a^2/sqrt(3) of a triangular, sqrt(3) a^2 of a square one, and so 4 pi a^4/(3 lambda^2) and
/// 12 pi a^4/lambda^2 far off. Source: Robertson 1947; Knott, Shaeffer, Tuley, Radar Cross Section. The orders in which
/// the faces are met differ for dielectrics only; their mean is taken.
void addTrihedralPath(const PoseContext& context, const ElementsInMap& elements, const Trihedral& trihedral,
                      const PathEvent& event, std::vector<PathRecord>& records);

}  // namespace mmradartwin
