#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"

namespace mmradartwin {

using RealGrid = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Axes of all range-angle maps of one radar.
struct RangeAngleAxes {
  std::vector<double> range_m;      ///< [N] r c/(2B)
  std::vector<double> azimuth_rad;  ///< [64] asin((a-32)/32 lambda_c/(2d)), ascending; NaN where |sine| > 1
};

struct RangeAngleMap {
  std::int64_t stamp_ns = 0;
  Branch source = Branch::kMeasured;
  RangeAngleAxes axes;
  RealGrid power_db;  ///< [N][64] dBFS, not normalised; -400 where nothing is, NaN where azimuth is
  int frames = 0;
  bool pose_valid = false;
  Eigen::Isometry3d T_map_radar = Eigen::Isometry3d::Identity();
};

constexpr int kAngleBins = 64;

/// Periodic Hann, w[n] = (1 - cos(2 pi n/N))/2.
std::vector<double> hannWindow(int samples);

/// The one signal chain of both branches: window, range FFT, spatial FFT, level (docs/reference/contracts.md section
/// 3). Const functions may be called from several threads at once (FFT plans and scratch space are per thread and
/// kept).
class SignalChain {
 public:
  /// Throws InputError where the virtual array is no uniform line along y.
  explicit SignalChain(const RadarConfig& radar);
  ~SignalChain();
  SignalChain(SignalChain&&) noexcept;
  SignalChain& operator=(SignalChain&&) noexcept;

  const RadarConfig& radar() const;
  const RangeAngleAxes& axes() const;
  /// Windowed range spectra X_k[r], [M][N], in units of the grid. Throws InputError on a wrong shape.
  ComplexGrid rangeSpectra(const ComplexGrid& x) const;
  /// S[r,a] = sum_k X_k[r] exp(+j 2 pi d k sin(theta_a)/lambda_c), [N][64]; k counts along RadarConfig::virtualLine().
  ComplexGrid spatialSpectra(const ComplexGrid& range_spectra) const;
  /// 20 log10(|S|/(M sum(w) full_scale)), M the elements of the line.
  RangeAngleMap map(const ReceiveGrid& grid) const;

 private:
  struct Plan;
  std::unique_ptr<Plan> plan_;
};

}  // namespace mmradartwin
