#include "fresnel_aperture.h"

#include <cmath>
#include <complex>

namespace mmradartwin {
namespace {

// E(u) = C(u) - jS(u) by the auxiliary functions f, g (Abramowitz and Stegun 7.3.9, 7.3.32, 7.3.33; error < 2e-3).
std::complex<double> fresnelE(double u) {
  const double a = std::abs(u);
  const double f = (1 + 0.926 * a) / (2 + 1.792 * a + 3.104 * a * a);
  const double g = 1 / (2 + 4.142 * a + 3.492 * a * a + 6.670 * a * a * a);
  const double phase = M_PI / 2 * a * a;
  const double c = 0.5 + f * std::sin(phase) - g * std::cos(phase);
  const double s = 0.5 - f * std::cos(phase) - g * std::sin(phase);
  return (u < 0 ? -1.0 : 1.0) * std::complex<double>(c, -s);
}

}  // namespace

double fresnelAperture(double u1, double u2) { return std::abs(fresnelE(u2) - fresnelE(u1)) / std::sqrt(2.0); }

}  // namespace mmradartwin
