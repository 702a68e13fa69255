#pragma once

#include <cmath>
#include <optional>

#include "physics/elements_in_map.h"

namespace mmradartwin {

/// A point that echoes alike in all directions.
struct PointEcho {
  PathRecord record;     ///< without contribution and event
  double amplitude = 0;  ///< of the radar equation, lambda sqrt(sigma)/((4 pi)^(3/2) r^2)
  double distance_m = 0;
};

/// Nothing where the radar does not see the place, or it lies beyond the range.
inline std::optional<PointEcho> pointEcho(const PoseContext& context, const Eigen::Vector3d& place,
                                          double cross_section_m2) {
  const ElementsInMap elements(context);
  const Eigen::Vector3d ray = place - elements.p;
  const double r = ray.norm();
  PointEcho echo;
  echo.distance_m = r;
  PathRecord& record = echo.record;
  record.departure = record.arrival = context.T_map_radar.linear().transpose() * ray / r;
  if (r > context.max_range_m || r < 0.01 || !context.inFieldOfView(record.departure)) return std::nullopt;
  if (!context.rays.visible(elements.p, place)) return std::nullopt;
  record.bounces = 1;
  record.vertices = {place};
  record.length_m = elements.lengthsVia(place);
  const double wavelength_m = kSpeedOfLight_m_per_s / context.frequency_hz;
  echo.amplitude = wavelength_m * std::sqrt(cross_section_m2) / (std::pow(4 * M_PI, 1.5) * r * r);
  return echo;
}

}  // namespace mmradartwin
