#include "physics/fresnel_integral.h"

#include <cmath>

namespace mmradartwin {
namespace {

/// Power series of integral_0^u exp(-j pi t^2/2) dt, for small u.
std::complex<double> series(double u) {
  const std::complex<double> step(0, -0.5 * M_PI * u * u);
  std::complex<double> term(u, 0), sum(u, 0);
  for (int n = 1; n < 200; ++n) {
    term *= step / static_cast<double>(n);
    const std::complex<double> add = term / static_cast<double>(2 * n + 1);
    sum += add;
    if (std::abs(add) < 1e-17 * std::abs(sum)) break;
  }
  return sum;
}

/// Tail integral_u^inf exp(-j pi t^2/2) dt by the continued fraction of erfc, for u > 0 not small.
std::complex<double> tail(double u) {
  // With z = u sqrt(j pi/2): tail = exp(-z^2)/(2 z sqrt(j pi/2)) * 1/(1 + 1/(2z^2)/(1 + 2/(2z^2)/(1 + ...))).
  const std::complex<double> z2(0, 0.5 * M_PI * u * u);
  const std::complex<double> q = 1.0 / (2.0 * z2);
  const int terms = 20 + static_cast<int>(400.0 / (u * u));
  std::complex<double> fraction = 1.0;
  for (int n = terms; n >= 1; --n) fraction = 1.0 + static_cast<double>(n) * q / fraction;
  const std::complex<double> root2(0, M_PI);  // 2 sqrt(j pi/2)^2
  return std::exp(-z2) / (root2 * u * fraction);
}

}  // namespace

std::complex<double> fresnelIntegral(double u) {
  const double a = std::abs(u);
  const std::complex<double> e = a < 2.2 ? series(a) : std::complex<double>(0.5, -0.5) - (a > 1e8 ? 0.0 : tail(a));
  return u < 0 ? -e : e;
}

}  // namespace mmradartwin
