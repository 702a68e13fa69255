#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// [E(u2) - E(u1)]/(1 - j): one axis of a rectangular aperture, 1 where it reaches far on both sides.
std::complex<double> apertureAxis(double u1, double u2);

/// (1/-2j) times the integral of exp(-j pi (u^2+v^2)/2) over a polygon in Fresnel units around the origin, as a
/// boundary integral (1/2pi) of (1 - exp(-j pi rho^2/2)) d phi. Loops are closed, outer ones counter-clockwise, holes
/// clockwise.
std::complex<double> aperturePolygon(const std::vector<std::vector<Eigen::Vector2d>>& loops);

/// Fresnel aperture factor of a facet (docs/reference/contracts.md section 4), in the exp(-jkL) convention: 1 for an
/// infinite facet. point: where the image ray meets the facet's plane; ray: its unit direction before or after;
/// before_m and after_m: path lengths on both sides of the point. Lengths on the facet are measured across the ray.
std::complex<double> apertureFactor(const Facet& facet, const Eigen::Vector3d& point, const Eigen::Vector3d& ray,
                                    double before_m, double after_m, double wavelength_m);

}  // namespace mmradartwin
