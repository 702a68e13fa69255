#pragma once

#include <complex>

namespace mmradartwin {

/// F(X) = 2j sqrt(X) exp(jX) integral from sqrt(X) to infinity of exp(-j t^2) dt, X >= 0; exp(-jkL) convention.
/// Source: Kouyoumjian and Pathak 1974, eq. 26.
std::complex<double> transitionFunction(double X);

/// How a ray meets a wedge.
struct WedgeGeometry {
  double n;                     ///< exterior angle over pi
  double phi, phi_in;           ///< of observer and source from face 0 through the exterior, 0 to n pi
  double distance_parameter_m;  ///< L = s s' sin^2(beta)/(s + s')
  double sin_beta;              ///< of the angle between ray and edge
};

/// Diffraction coefficient of a wedge, in sqrt(m), exp(-jkL) convention: the diffracted field is that at the edge times
/// coefficient * sqrt(s'/(s (s + s'))) exp(-jks) for a spherical wave. gamma_0, gamma_n: reflection coefficients of the
/// faces for the polarisation asked for (a conductor's are -1 with E along the edge, +1 with H along it).
/// Source: Kouyoumjian and Pathak 1974, eq. 25; coefficients in its reflection terms after Luebbers 1984.
std::complex<double> wedgeCoefficient(const WedgeGeometry& wedge, double wavenumber, std::complex<double> gamma_0,
                                      std::complex<double> gamma_n);

}  // namespace mmradartwin
