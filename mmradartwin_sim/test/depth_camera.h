#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "mmradartwin_sim/ray_caster.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// What a D435i would see of a scene: 87 x 58 deg, disparity noise (grows with depth squared), half of it alike over
/// neighbouring pixels as block matching leaves it, holes at edges, at glancing surfaces, in blobs and at random.
class DepthCamera {
 public:
  double noise_per_m = 0.004;  ///< standard deviation of depth z is noise_per_m z^2
  double far_m = 6;
  int columns = 212, rows = 120;

  /// Points in the camera's frame, x forward, y left, z up.
  std::vector<Eigen::Vector3d> cloud(const RayCaster& rays, const Scene& scene, const Eigen::Isometry3d& T_map_camera,
                                     std::mt19937& random) const {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> unit(0, 1);
    const int block = 8, block_columns = columns / block + 2;
    std::vector<double> shared(static_cast<std::size_t>(block_columns * (rows / block + 2)));
    for (double& v : shared) v = normal(random);
    std::vector<bool> blob(shared.size());
    for (std::size_t i = 0; i < blob.size(); ++i) blob[i] = unit(random) < 0.05;
    const double tan_h = std::tan(43.5 * M_PI / 180), tan_v = std::tan(29 * M_PI / 180);
    std::vector<double> depth(static_cast<std::size_t>(columns * rows), 0);
    std::vector<Eigen::Vector3d> direction(depth.size());
    for (int v = 0; v < rows; ++v) {
      for (int u = 0; u < columns; ++u) {
        const std::size_t i = static_cast<std::size_t>(v * columns + u);
        direction[i] = Eigen::Vector3d(1, tan_h * (1 - 2 * (u + 0.5) / columns), tan_v * (1 - 2 * (v + 0.5) / rows));
        const Eigen::Vector3d d = (T_map_camera.linear() * direction[i]).normalized();
        const auto hit = rays.firstHit(T_map_camera.translation(), d, 2 * far_m);
        if (!hit) continue;
        if (hit->facet >= 0 && std::abs(scene.facets[hit->facet].normal.dot(d)) < 0.12) continue;
        const double z = hit->distance_m / direction[i].norm();
        if (z > 0.25 && z < far_m) depth[i] = z;
      }
    }
    std::vector<Eigen::Vector3d> points;
    for (int v = 1; v + 1 < rows; ++v) {
      for (int u = 1; u + 1 < columns; ++u) {
        const std::size_t i = static_cast<std::size_t>(v * columns + u), b = shared_index(u, v, block, block_columns);
        const double z = depth[i];
        const bool edge = std::abs(depth[i - 1] - z) > 0.15 || std::abs(depth[i + 1] - z) > 0.15;
        if (z <= 0 || blob[b] || (edge && unit(random) < 0.7) || unit(random) < 0.03) continue;
        const double noise = std::sqrt(0.5) * (normal(random) + shared[b]);
        points.push_back((z + noise_per_m * z * z * noise) * direction[i]);
      }
    }
    return points;
  }

 private:
  static std::size_t shared_index(int u, int v, int block, int block_columns) {
    return static_cast<std::size_t>((v / block) * block_columns + u / block);
  }
};

/// A place to stand: nothing within clearance_m, walls on most sides, and something like a floor below.
inline bool freePlace(const RayCaster& rays, const Eigen::Vector3d& p, double clearance_m) {
  int met = 0;
  for (int i = 0; i < 24; ++i) {
    const double a = i * M_PI / 12;
    for (const double dz : {-0.3, 0.0, 0.3}) {
      const auto hit = rays.firstHit(p, Eigen::Vector3d(std::cos(a), std::sin(a), dz).normalized(), 20);
      if (hit && hit->distance_m < clearance_m) return false;
      if (hit) ++met;
    }
  }
  const auto floor = rays.firstHit(p, {0, 0, -1}, 2.2);
  return met > 48 && floor && floor->distance_m > 0.7;
}

}  // namespace mmradartwin
