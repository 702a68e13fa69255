#include "echoes/curved_echo.h"

#include <algorithm>
#include <cmath>

#include "physics/aperture.h"

namespace mmradartwin {
namespace {

constexpr double kInset_m = 0.01;
constexpr double kSmallestCurvedFactor = 0.01;

}  // namespace

std::optional<CurvedEcho> curvedEcho(const PoseContext& context, const ElementsInMap& elements,
                                     const CurvedSurface& surface) {
  const double inset = std::min(kInset_m, 0.5 * surface.length_m);
  const auto along = [&](const Eigen::Vector3d& p) { return surface.axis.dot(p - surface.center); };
  /// Point of the sphere's centre or the cylinder's axis that the normal through p runs through.
  const auto core = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return surface.sphere ? surface.center : Eigen::Vector3d(surface.center + along(p) * surface.axis);
  };
  const auto nearest = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    const Eigen::Vector3d c = core(p), on = c + surface.radius_m * (p - c).normalized();
    if (surface.sphere) return on;
    return on + (std::min(surface.length_m - inset, std::max(inset, along(p))) - along(p)) * surface.axis;
  };
  const Eigen::Vector3d inward = core(elements.p) - elements.p;
  const double R = inward.norm() - surface.radius_m;
  if (R <= 1e-3) return std::nullopt;
  CurvedEcho echo;
  echo.straight = inward.normalized();
  echo.vertex = nearest(elements.p);
  echo.distance_m = (echo.vertex - elements.p).norm();
  if (echo.distance_m > context.max_range_m) return std::nullopt;
  echo.direction = (echo.vertex - elements.p) / echo.distance_m;
  echo.direction_radar = context.T_map_radar.linear().transpose() * echo.direction;
  if (!context.inFieldOfView(echo.direction_radar)) return std::nullopt;
  const double wavelength = context.radar.wavelength_m(), divergence = surface.radius_m / (surface.radius_m + R);
  std::complex<double> factor = 1;
  if (!surface.sphere) {
    const double unit = 2 / std::sqrt(wavelength * R), foot = along(elements.p);
    factor = apertureAxis(-foot * unit, (surface.length_m - foot) * unit);
    if (std::abs(factor) < kSmallestCurvedFactor) return std::nullopt;
  }
  echo.coefficient = wavelength / (8 * M_PI * R) * (surface.sphere ? divergence : std::sqrt(divergence)) * factor;
  // The reflection point of a transmitter and a receiver that stand close lies at the middle of both.
  for (const auto& t : elements.tx) {
    for (const auto& r : elements.rx) {
      const Eigen::Vector3d q = nearest(0.5 * (t + r));
      echo.length_m.push_back((q - t).norm() + (q - r).norm());
    }
  }
  return echo;
}

}  // namespace mmradartwin
