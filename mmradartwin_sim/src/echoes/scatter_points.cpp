#include "echoes/scatter_points.h"

#include <cmath>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

/// SplitMix64: one step turns any number into an unrelated one.
std::uint64_t scramble(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

double unitInterval(std::uint64_t h) { return static_cast<double>(h >> 11) * 0x1.0p-53; }

std::uint64_t hashText(const std::string& text) {
  std::uint64_t h = 1469598103934665603ULL;
  for (unsigned char c : text) h = (h ^ c) * 1099511628211ULL;
  return h;
}

/// One point in each cell of a grid in the facet's own coordinates, anywhere in its cell; all from hashes of facet
/// and cell, so that the points move with the facet and nothing else changes them.
void addPoints(const Facet& facet, std::uint64_t facet_hash, double spacing_m, const std::string& mechanism,
               std::vector<ScatterPoint>& points) {
  // A size halfway between two numbers of cells rounds up however the room is turned.
  const auto cells = [spacing_m](double size_m) {
    return std::max(1, static_cast<int>(std::lround(size_m / spacing_m + 1e-6)));
  };
  const int n1 = cells(facet.size1_m), n2 = cells(facet.size2_m);
  if (static_cast<double>(n1) * n2 > 4e6) {
    throw InputError("mechanism " + mechanism + ": key spacing_m: " + std::to_string(spacing_m) +
                     " m gives millions of scatter points on one facet; choose a wider spacing");
  }
  const double d1 = facet.size1_m / n1, d2 = facet.size2_m / n2;
  const std::size_t first = points.size();
  for (int i = 0; i < n1; ++i) {
    for (int j = 0; j < n2; ++j) {
      const std::uint64_t h =
          scramble(facet_hash ^ scramble((static_cast<std::uint64_t>(i) << 32) | static_cast<std::uint32_t>(j)));
      const Eigen::Vector3d q = facet.origin + (i + unitInterval(scramble(h + 1))) * d1 * facet.e1 +
                                (j + unitInterval(scramble(h + 2))) * d2 * facet.e2;
      if (!facet.rectangle && !facet.contains(q)) continue;
      points.push_back({q, facet.id, d1 * d2, h});
    }
  }
  if (points.size() == first) {
    // Too slim for any cell's point: one stands for the whole.
    const Eigen::Vector3d middle = facet.origin + 0.5 * (facet.size1_m * facet.e1 + facet.size2_m * facet.e2);
    points.push_back({facet.nearest(middle, 1e-3), facet.id, facet.area_m2, facet_hash});
    return;
  }
  const double scale = facet.area_m2 / (d1 * d2 * static_cast<double>(points.size() - first));
  for (std::size_t i = first; i < points.size(); ++i) points[i].area_m2 *= scale;
}

}  // namespace

double ScatterPoint::phase_rad(std::uint64_t seed) const {
  return 2 * M_PI * unitInterval(scramble(hash ^ scramble(seed)));
}

std::vector<ScatterPoint> pointsOnFacets(const Scene& scene, double spacing_m, const std::string& mechanism,
                                         const std::function<bool(const Facet&)>& accepted) {
  std::vector<ScatterPoint> points;
  for (const Actor& actor : scene.actors) {
    const std::uint64_t actor_hash = hashText(actor.name);
    for (std::size_t i = 0; i < actor.facets.size(); ++i) {
      const Facet& facet = scene.facets[actor.facets[i]];
      if (accepted(facet)) addPoints(facet, scramble(actor_hash + i), spacing_m, mechanism, points);
    }
  }
  return points;
}

std::vector<ScatterPoint> makeScatterPoints(const Scene& scene, double spacing_m, double frequency_hz,
                                            const std::string& mechanism,
                                            const std::function<bool(const Facet&)>& accepted) {
  std::vector<bool> scatters;
  for (const Actor& actor : scene.actors) {
    scatters.push_back(actor.present && backscatterAmplitude(actor.material, 1, 1, frequency_hz) > 0);
  }
  return pointsOnFacets(scene, spacing_m, mechanism, [&](const Facet& f) {
    return scatters[static_cast<std::size_t>(f.actor)] && f.reflects && f.present && accepted(f);
  });
}

}  // namespace mmradartwin
