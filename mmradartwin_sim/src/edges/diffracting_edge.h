#pragma once

#include <Eigen/Geometry>
#include <complex>
#include <functional>
#include <optional>
#include <vector>

#include "physics/elements_in_map.h"
#include "physics/polarisation.h"

namespace mmradartwin {

/// An exposed edge: the line origin + [0, length] along, between two facets or at the free rim of one.
struct DiffractingEdge {
  int a, b;  ///< facet ids, the same at a rim
  Eigen::Vector3d origin, along;
  double length_m;
  Eigen::Vector3d into_a;   ///< unit, in face a, away from the edge; angles count from here ...
  Eigen::Vector3d side;     ///< ... through this direction (unit, across the edge) to face b
  Eigen::Vector3d outward;  ///< unit, across the edge, away from both faces
  double n;                 ///< exterior angle over pi: 2 at a rim, 1.5 at a box's edge
};

enum class EdgesOf { kFacetsThatTakePart, kAllFacets };

/// Edges of the facet graph that diffract: folds of more than 20 deg between two facets of one actor, and rims of open
/// facets, along the stretches (2 cm and more) where no other facet touches them.
/// Where two facets enclose less than half a turn of air, the edge is a corner of the room as seen from there;
/// diffract() tells by the angles. The stretch where tessellations of two facets share no vertices is not found.
std::vector<DiffractingEdge> findDiffractingEdges(const Scene& scene, EdgesOf those = EdgesOf::kFacetsThatTakePart);

/// How one edge returns a field from source to observer.
struct EdgeReturn {
  Eigen::Vector3d point;        ///< on the edge
  std::complex<double> factor;  ///< times lambda/(4 pi): the path's coefficient, exp(-jkL) convention
};

/// UTD return of an edge: diffraction point, spreading 1/sqrt(s s' (s + s')), polarisation, Fresnel aperture of the
/// edge's length; the faces reflect as slabs where their thickness is known, else as half spaces. None where source or
/// observer are not in the wedge's exterior, or where the diffraction point lies beyond the edge's ends (Keller's law:
/// what vertices send is not UTD's edge). incident: field at the edge of a unit source; receive: field vector of the
/// receiving antenna, functions of the diffraction point.
std::optional<EdgeReturn> diffract(const PoseContext& context, const DiffractingEdge& edge,
                                   const Eigen::Vector3d& source, const Eigen::Vector3d& observer,
                                   const std::function<ComplexVector(const Eigen::Vector3d& point)>& incident,
                                   const Eigen::Vector3d& up);

/// Shortest length from a over the edge's line to b.
double lengthOverEdge(const DiffractingEdge& edge, const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace mmradartwin
