#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <complex>
#include <cstdint>

namespace mmradartwin {

enum class Branch : std::uint8_t { kMeasured = 0, kSimulated = 1 };

/// Channels x samples, row-major so that a channel's fast time is contiguous.
using ComplexGrid = Eigen::Matrix<std::complex<double>, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Complex receive grid in the convention x = I + jQ (docs/reference/contracts.md section 3).
struct ReceiveGrid {
  std::int64_t stamp_ns = 0;
  Branch source = Branch::kMeasured;
  ComplexGrid x;                ///< [M][N], in units of full_scale
  double full_scale = 32768.0;  ///< 32768 for ADC counts, 1 for path amplitudes
  int frames = 0;               ///< frames averaged
  bool pose_valid = false;
  Eigen::Isometry3d T_map_radar = Eigen::Isometry3d::Identity();
};

}  // namespace mmradartwin
