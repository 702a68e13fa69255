#pragma once

#include <complex>

namespace mmradartwin {

/// E(u) = C(u) - j S(u), C and S the Fresnel integrals of cos and sin(pi t^2/2); error below 1e-13.
/// E(+-infinity) = +-(1-j)/2. Source: Abramowitz and Stegun 7.3.11 to 7.3.14 (series), 7.1.14 (continued fraction).
std::complex<double> fresnelIntegral(double u);

}  // namespace mmradartwin
