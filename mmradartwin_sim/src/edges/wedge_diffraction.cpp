#include "edges/wedge_diffraction.h"

#include <cmath>

#include "physics/fresnel_integral.h"

namespace mmradartwin {
namespace {

using Complex = std::complex<double>;

/// cot((pi + sign beta)/(2n)) F(kL a(beta)), finite on the shadow boundary too.
Complex term(double n, double sign, double beta, double kL) {
  const double whole = std::round((beta + sign * M_PI) / (2 * M_PI * n));
  // Distance from the shadow boundary that this term mends: (pi + sign beta)/(2n) = pi whole' + sign epsilon/(2n).
  const double epsilon = beta + sign * (M_PI - sign * 2 * M_PI * n * whole);
  const double root = std::sqrt(2.0) * std::abs(std::sin(0.5 * epsilon));  // sqrt(a): a = 2 cos^2((2 pi n N - beta)/2)
  const double angle = sign * epsilon / (2 * n);                           // up to whole turns of the cotangent
  if (std::abs(epsilon) < 1e-7) {
    // F(X) -> (sqrt(pi X) - 2 X exp(j pi/4)) exp(j(pi/4 + X)), eq. 29.
    const double side = epsilon > 0 ? 1 : (epsilon < 0 ? -1 : 0);
    return sign * n * (std::sqrt(2 * M_PI * kL) * side - 2 * kL * epsilon * std::polar(1.0, M_PI / 4)) *
           std::polar(1.0, M_PI / 4);
  }
  return transitionFunction(kL * root * root) / std::tan(angle);
}

}  // namespace

std::complex<double> transitionFunction(double X) {
  if (X > 1000) {
    const Complex q(0, 0.5 / X);  // asymptotic series in 1/(-2jX)
    return 1.0 + q + 3.0 * q * q + 15.0 * q * q * q;
  }
  const double root = std::sqrt(X);
  const Complex tail = Complex(0.5, -0.5) - fresnelIntegral(root * std::sqrt(2 / M_PI));
  return Complex(0, 2 * root) * std::polar(1.0, X) * std::sqrt(0.5 * M_PI) * tail;
}

std::complex<double> wedgeCoefficient(const WedgeGeometry& wedge, double wavenumber, std::complex<double> gamma_0,
                                      std::complex<double> gamma_n) {
  const double n = wedge.n;
  const double kL = wavenumber * wedge.distance_parameter_m, minus = wedge.phi - wedge.phi_in,
               plus = wedge.phi + wedge.phi_in;
  const Complex sum =
      term(n, 1, minus, kL) + term(n, -1, minus, kL) + gamma_n * term(n, 1, plus, kL) + gamma_0 * term(n, -1, plus, kL);
  return -std::polar(1.0, -M_PI / 4) / (2 * n * std::sqrt(2 * M_PI * wavenumber) * wedge.sin_beta) * sum;
}

}  // namespace mmradartwin
