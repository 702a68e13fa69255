#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mmradartwin_sim/scan_to_scene.h"

namespace mmradartwin {

/// A scan thinned to one sample a voxel, in metres, axes of the file.
struct ScanSamples {
  std::vector<Eigen::Vector3f> points;   ///< mean of the voxel's points
  std::vector<Eigen::Vector3f> normals;  ///< unit, of the plane through the neighbours; zero where there are too few
  std::vector<float> flatness_m;         ///< rms distance of the neighbours from that plane
  std::vector<Eigen::Vector3f> colors;   ///< 0 to 1, or empty
  bool oriented = false;                 ///< normals point to the side from which the scan saw the surface
  double spacing_m = 0;                  ///< side of a voxel
  double noise_m = 0;                    ///< rms distance from planes of 0.8 m, at the flattest tenth of places
  /// Of one frame of a depth camera, whose errors grow with range: those of each sample, 1 sigma along its ray of
  /// sight. Else empty, and noise_m holds of all.
  std::vector<Eigen::Vector3f> error_m;
  // Neighbours of sample i: neighbour[first[i]] to neighbour[first[i + 1]].
  std::vector<std::size_t> first;
  std::vector<int> neighbour;
  // All points of the scan, those of sample i between dense_first[i] and dense_first[i + 1].
  std::vector<Eigen::Vector3f> dense;
  std::vector<std::size_t> dense_first;
  std::vector<int> dense_triangle;  ///< of a mesh, that each of these points lies on

  std::size_t size() const { return points.size(); }
  Eigen::Vector3d at(int i) const { return points[static_cast<std::size_t>(i)].cast<double>(); }
  /// Standard deviation of a sample along a plane's normal.
  double noiseAlong(int i, const Eigen::Vector3d& normal) const {
    return error_m.empty() ? noise_m : std::abs(error_m[static_cast<std::size_t>(i)].cast<double>().dot(normal));
  }
  double area_m2() const { return spacing_m * spacing_m; }  ///< what a sample stands for
};

using Progress = std::function<void(double, const std::string&)>;

/// Triangles larger than a voxel get points of their own, so that large ones count by their area.
ScanSamples thinScan(const RawScan& scan, double unit_m, const Progress& progress);

}  // namespace mmradartwin
