#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// [E(u2) - E(u1)]/(1 - j): one axis of a rectangular aperture, 1 where it reaches far on both sides.
std::complex<double> apertureAxis(double u1, double u2);

/// One end of a strip: its Fresnel parameter by the exact extra path, (pi/2) u^2 = k times it, and what a step of u
/// there weighs against one at the strip's foot.
struct StripEnd {
  double u;
  std::complex<double> weight;
};

/// Integral over a strip of exp(-j pi u^2/2) with a weight that changes along it, over (1 - j): the foot's weight times
/// apertureAxis() and the end points' first corrections (Chester, Friedman and Ursell 1957; Bleistein 1966).
std::complex<double> stripFactor(const StripEnd& low, const StripEnd& high, std::complex<double> weight_at_foot);

/// (1/-2j) times the integral of exp(-j pi (u^2+v^2)/2) over a polygon in Fresnel units around the origin, as a
/// boundary integral (1/2pi) of (1 - exp(-j pi rho^2/2)) d phi. Loops are closed, outer ones counter-clockwise, holes
/// clockwise.
std::complex<double> aperturePolygon(const std::vector<std::vector<Eigen::Vector2d>>& loops);

/// The boundary integral's part of a straight edge, h > 0 Fresnel units from the ray, beyond l >= 0: the integral from
/// l to infinity of exp(-j pi t^2/2) h/(h^2 + t^2) dt.
std::complex<double> edgeBeyond(double l, double h);

/// Fresnel aperture factor of a facet (docs/reference/contracts.md section 4), in the exp(-jkL) convention: 1 for an
/// infinite facet. point: where the image ray meets the facet's plane; ray: its unit direction before or after;
/// before_m and after_m: path lengths on both sides of the point. Lengths on the facet are measured across the ray.
std::complex<double> apertureFactor(const Facet& facet, const Eigen::Vector3d& point, const Eigen::Vector3d& ray,
                                    double before_m, double after_m, double wavelength_m);

/// The same for the echo of a facet at a distance R_m along its normal, whose foot may lie beside it: physical optics
/// with its exact paths and obliquity where the facet is a rectangle.
std::complex<double> echoFactor(const Facet& facet, const Eigen::Vector3d& foot, double R_m, double wavelength_m);

}  // namespace mmradartwin
