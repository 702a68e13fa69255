#pragma once

#include <Eigen/Geometry>
#include <complex>
#include <vector>

#include "mmradartwin_sim/pose_context.h"
#include "mmradartwin_sim/scene.h"
#include "rays/image_paths.h"

namespace mmradartwin {

/// Two knife edges in turn: what is left of the field where a ray passes them at Fresnel parameters nu_1 and nu_2
/// (positive on the dark side), less the product of what each leaves alone. correlation: cosine of the angle between
/// the edges' dark sides, times sqrt(d_1 (s - d_2)/(d_2 (s - d_1))) for edges at d_1 <= d_2 along a path of length s.
/// In the exp(-jkL) convention. docs/reference/contracts.md section 4 has the formula.
std::complex<double> jointKnifeEdges(double nu_1, double nu_2, double correlation);

/// The edges of a scene's things as they lie beside paths. A path that grazes some weighs by the field behind them and
/// not by 0 or 1.
class GrazedEdges {
 public:
  explicit GrazedEdges(const Scene& scene);
  /// True where the leg passes an edge on its dark side, within the first Fresnel zone.
  bool passes(const PathLeg& leg, double wavelength_m) const;
  /// What the edges leave of a path's field, 1 where none is near, 0 where something else is in the way. Legs are free,
  /// or passes() holds for them. In the exp(-jkL) convention.
  std::complex<double> factor(const PoseContext& context, const PathLegs& legs) const;

 private:
  /// A facet that ends where it meets a face of an edge at a right angle. Nothing of the face lies between the facet
  /// and a point within the wedge: the edge is the end of the corner's aperture, and hides none of the facet.
  struct EndOfWedge {
    int facet;
    Eigen::Vector3d fold, into_facet, into_face;
    bool holds(const Eigen::Vector3d& p) const {
      return (p - fold).dot(into_facet) > 0 && (p - fold).dot(into_face) > 0;
    }
  };
  struct Edge {
    Eigen::Vector3d origin, along;
    double length_m;
    Eigen::Vector3d into[2];  // unit, in the faces, away from the edge
    int facets[2];
    int actor;
    std::vector<EndOfWedge> ends;
  };
  struct Graze;
  void addEndOfWedge(const EndOfWedge& end, int face);
  /// Whether the edge bounds a face of a corner with a facet that the leg begins or ends at.
  static bool hidesNone(const Edge& edge, const PathLeg& leg);
  template <typename Found>
  void forEachNear(const PathLeg& leg, double wavelength_m, double reach, const Found& found) const;

  const Scene& scene_;
  std::vector<Edge> edges_;
  // Their middles and half lengths once more, close together for the first look.
  std::vector<float> x_, y_, z_, half_;
};

}  // namespace mmradartwin
