#include "physics/aperture.h"

#include <array>
#include <cmath>

#include "physics/fresnel_integral.h"

namespace mmradartwin {
namespace {

using Complex = std::complex<double>;

constexpr std::array<double, 8> kGaussNode = {-0.9602898564975363, -0.7966664774136267, -0.5255324099163290,
                                              -0.1834346424956498, 0.1834346424956498,  0.5255324099163290,
                                              0.7966664774136267,  0.9602898564975363};
constexpr std::array<double, 8> kGaussWeight = {0.1012285362903763, 0.2223810344533745, 0.3137066458778873,
                                                0.3626837833783620, 0.3626837833783620, 0.3137066458778873,
                                                0.2223810344533745, 0.1012285362903763};

Complex phasor(double cycles_half) { return std::polar(1.0, -0.5 * M_PI * cycles_half); }

/// integral_a^b exp(-j pi l^2/2) h/(h^2+l^2) dl on a stretch where the integrand is smooth.
Complex stretch(double a, double b, double h) {
  Complex sum = 0;
  const double middle = 0.5 * (a + b), half = 0.5 * (b - a);
  for (std::size_t i = 0; i < kGaussNode.size(); ++i) {
    const double l = middle + half * kGaussNode[i];
    sum += kGaussWeight[i] * phasor(l * l) * (h / (h * h + l * l));
  }
  return sum * half;
}

/// The integral from a >= 0 to infinity, for h > 0.
Complex toInfinity(double a, double h) {
  constexpr double kTurn = 2;  // from here on along l = start + (1-j) t, where the integrand decays without turning
  Complex sum = 0;
  double from = a;
  while (from < kTurn) {
    const double to =
        std::min(kTurn, from + std::min(0.5, std::max(h, from)));  // steps grow away from the pole at l = +-jh
    sum += stretch(from, to, h);
    from = to;
  }
  const double scale = 1.0 / (M_PI * from);  // e-folding length of the decay
  const Complex turned(1, -1);
  const double half = 1.5 * scale;
  for (int panel = 0; panel < 8; ++panel) {
    for (std::size_t i = 0; i < kGaussNode.size(); ++i) {
      const Complex l = from + turned * (half * (2 * panel + 1 + kGaussNode[i]));
      sum += kGaussWeight[i] * half * turned * std::exp(Complex(0, -0.5 * M_PI) * l * l) * (h / (h * h + l * l));
    }
  }
  return sum;
}

}  // namespace

std::complex<double> apertureAxis(double u1, double u2) {
  return (fresnelIntegral(u2) - fresnelIntegral(u1)) / Complex(1, -1);
}

std::complex<double> stripFactor(const StripEnd& low, const StripEnd& high, std::complex<double> weight_at_foot) {
  const auto correction = [&](const StripEnd& end) -> Complex {
    if (std::abs(end.u) < 1e-6) return 0;  // weights are even about the foot
    return (end.weight - weight_at_foot) / end.u * phasor(end.u * end.u) / Complex(0, -M_PI);
  };
  return weight_at_foot * apertureAxis(low.u, high.u) + (correction(high) - correction(low)) / Complex(1, -1);
}

std::complex<double> edgeBeyond(double l, double h) { return toInfinity(l, h); }

std::complex<double> aperturePolygon(const std::vector<std::vector<Eigen::Vector2d>>& loops) {
  Complex sum = 0;
  double turn = 0;
  for (const auto& loop : loops) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Eigen::Vector2d& a = loop[i];
      const Eigen::Vector2d& b = loop[(i + 1) % loop.size()];
      const Eigen::Vector2d along = b - a;
      const double length = along.norm();
      if (length < 1e-12) continue;
      const Eigen::Vector2d unit = along / length;
      const double signed_h = a.x() * unit.y() - a.y() * unit.x();
      // On the line itself the angle does not change but in the pole; half of it is counted, as on any boundary.
      const double h = std::abs(signed_h);
      if (h < 1e-9) continue;
      const double l1 = a.dot(unit), l2 = b.dot(unit);
      turn += std::atan2(signed_h * length, a.dot(b));
      Complex part;
      if (l1 >= 0) {
        part = toInfinity(l1, h) - toInfinity(l2, h);
      } else if (l2 <= 0) {
        part = toInfinity(-l2, h) - toInfinity(-l1, h);
      } else {
        part = 2.0 * toInfinity(0, h) - toInfinity(l2, h) - toInfinity(-l1, h);
      }
      sum += (signed_h > 0 ? 1.0 : -1.0) * phasor(h * h) * part;
    }
  }
  return (turn - sum) / (2 * M_PI);
}

std::complex<double> apertureFactor(const Facet& facet, const Eigen::Vector3d& point, const Eigen::Vector3d& ray,
                                    double before_m, double after_m, double wavelength_m) {
  const double scale = std::sqrt(2 * (before_m + after_m) / (wavelength_m * before_m * after_m));
  const double r1 = ray.dot(facet.e1), r2 = ray.dot(facet.e2);
  const double m11 = 1 - r1 * r1, m22 = 1 - r2 * r2, m12 = -r1 * r2;
  const double x = (point - facet.origin).dot(facet.e1), y = (point - facet.origin).dot(facet.e2);
  if (facet.rectangle && std::abs(m12) < 0.02) {
    const double k1 = scale * std::sqrt(m11), k2 = scale * std::sqrt(m22);
    return apertureAxis(-x * k1, (facet.size1_m - x) * k1) * apertureAxis(-y * k2, (facet.size2_m - y) * k2);
  }
  // Cholesky factor of the quadratic form turns lengths across the ray into Fresnel units.
  const double l11 = std::sqrt(std::max(m11, 1e-12)), l21 = m12 / l11;
  const double l22 = std::sqrt(std::max(m22 - l21 * l21, 1e-12));
  std::vector<std::vector<Eigen::Vector2d>> loops;
  loops.reserve(facet.loops.size());
  for (const auto& loop : facet.loops) {
    loops.emplace_back();
    loops.back().reserve(loop.size());
    for (const auto& p : loop) {
      const double dx = p.x() - x, dy = p.y() - y;
      loops.back().emplace_back(scale * (l11 * dx + l21 * dy), scale * l22 * dy);
    }
  }
  return aperturePolygon(loops);
}

std::complex<double> echoFactor(const Facet& facet, const Eigen::Vector3d& foot, double R_m, double wavelength_m) {
  if (!facet.rectangle) return apertureFactor(facet, foot, facet.normal, R_m, R_m, wavelength_m);
  const double x = (foot - facet.origin).dot(facet.e1), y = (foot - facet.origin).dot(facet.e2);
  struct Side {
    double low_m, high_m;
    double beside_m() const { return std::max({low_m, -high_m, 0.0}); }
  };
  Side along{-x, facet.size1_m - x}, across{-y, facet.size2_m - y};
  if (across.beside_m() > along.beside_m()) std::swap(along, across);
  const auto acrossAt = [&](double r_m) {
    const double unit = 2 / std::sqrt(wavelength_m * r_m);
    return apertureAxis(across.low_m * unit, across.high_m * unit);
  };
  const auto end = [&](double at_m) -> StripEnd {
    const double r_m = std::hypot(R_m, at_m), extra_m = at_m * at_m / (r_m + R_m);
    const double u = (at_m < 0 ? -1 : 1) * std::sqrt(8 * extra_m / wavelength_m);
    if (std::abs(u) < 1e-6) return {u, 1.0};
    // exp(-2jkr) R/r^3 over the plane; steps of u are steps of 4 sin/(lambda u) along it, the other axis has sqrt(r).
    const double step = wavelength_m * u * r_m / (4 * at_m) / (0.5 * std::sqrt(wavelength_m * R_m));
    const double ratio = R_m / r_m;
    return {u, ratio * ratio * std::sqrt(ratio) * step * acrossAt(r_m)};
  };
  return stripFactor(end(along.low_m), end(along.high_m), acrossAt(R_m));
}

}  // namespace mmradartwin
