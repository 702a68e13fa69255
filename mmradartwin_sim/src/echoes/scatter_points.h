#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// One point of a rough surface that stands for area_m2 around it.
struct ScatterPoint {
  Eigen::Vector3d position;
  int facet;
  double area_m2;
  std::uint64_t hash;  ///< of facet and cell

  /// Phase of this point's echo, a fixed random number of the seed; the same in all directions.
  double phase_rad(std::uint64_t seed) const;
};

/// Points on all accepted facets of the scene, about one per spacing_m squared. Throws InputError naming the mechanism
/// where that is millions of points.
std::vector<ScatterPoint> pointsOnFacets(const Scene& scene, double spacing_m, const std::string& mechanism,
                                         const std::function<bool(const Facet&)>& accepted);
/// Points on all facets of the scene that scatter at this frequency, take part and are accepted, see
/// pointsOnFacets().
std::vector<ScatterPoint> makeScatterPoints(const Scene& scene, double spacing_m, double frequency_hz,
                                            const std::string& mechanism,
                                            const std::function<bool(const Facet&)>& accepted);

}  // namespace mmradartwin
