#pragma once

#include <Eigen/Geometry>
#include <complex>
#include <functional>
#include <string>
#include <vector>

#include "physics/elements_in_map.h"
#include "physics/path_event.h"

namespace mmradartwin {

constexpr double kFacesMeet_m = 0.002;  ///< faces that come this near to their planes' common line meet in it

/// A concave edge of two facets: the line origin + [0, length] along, with one face on each side of the wedge.
struct CornerEdge {
  int a, b;  ///< facet ids
  Eigen::Vector3d origin, along;
  double length_m;
  Eigen::Vector3d into_a, into_b;  ///< unit, in the faces, away from the edge; the wedge lies between them
  double reach_a_m, reach_b_m;     ///< from the edge to the far ends of the faces
};

/// Edges at a right angle (within 0.1 deg) of the facets that take part, for the pairs asked for; the first facet of a
/// pair has the lower id. Faces meet that come within meet_m of their planes' common line.
std::vector<CornerEdge> findCornerEdges(const Scene& scene, double meet_m,
                                        const std::function<bool(const Facet&)>& takes_part,
                                        const std::function<bool(const Facet&, const Facet&)>& pair);

/// The part of two faces across the ray that makes up a corner's aperture.
enum class CornerAperture {
  kBothFaces,       ///< from the far end of the one to the far end of the other (docs/reference/contracts.md section 4,
                    ///< `corner`)
  kNarrowerFace,    ///< as far to both sides as the narrower reaches: what meets one face leaves as far on the other
  kPhysicalOptics,  ///< likewise, each face by physical optics with its exact paths in the light that the other
                    ///< reflects
};

/// Fresnel aperture factor of an edge's two faces for the retro path to a point, 1 for large ones.
std::complex<double> cornerFactor(const CornerEdge& edge, const Eigen::Vector3d& from, double wavelength_m,
                                  CornerAperture aperture = CornerAperture::kBothFaces);

/// The retro path of one edge as seen from one pose, where there is one.
void addCornerPath(const PoseContext& context, const ElementsInMap& elements, const CornerEdge& edge,
                   const PathEvent& event, std::vector<PathRecord>& records,
                   CornerAperture aperture = CornerAperture::kBothFaces);

}  // namespace mmradartwin
