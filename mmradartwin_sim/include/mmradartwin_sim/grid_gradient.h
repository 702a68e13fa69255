#pragma once

#include <complex>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_sim/path_record.h"

namespace mmradartwin {

/// Derivatives of the propagated grid x [M][N] of one pose by continuous parameters, in closed form from its records:
/// x_k[n] = sum of c_k exp(j 2 pi mu (L_k/c)(t_n - t_c)), whose phase grows with a path's length by
/// 2 pi/c (f_c + mu (t_n - t_c) - mu tau). Paths neither appear nor vanish in them, and weights that change with a
/// path's direction are held. Derivatives by a material's or mechanism's weight are WeightBasis' group grids; dB of
/// amplitude are ln(10)/20 of them.
class GridGradient {
 public:
  /// The records have to outlive the gradient.
  GridGradient(const RadarConfig& radar, const std::vector<PathRecord>& records) : radar_(radar), records_(records) {}

  ComplexGrid byRangeBias_per_m() const;  ///< range_bias: every length grows by twice the bias
  ComplexGrid byRangeScale() const;       ///< range_scale: beat frequencies scale, phases at t_c stay
  ComplexGrid byWeight_per_db() const;    ///< level of all these records
  /// The radar turned about its z through its origin, positive to the left. Far field of the array: the elements' share
  /// of a length is that of the record's directions (relative error of the order of the array's size over the range).
  ComplexGrid byYaw_per_rad() const;
  /// The phase of one virtual element: its row times j.
  ComplexGrid byChannelPhase_per_rad(int channel) const;

 private:
  /// For lengths that grow by growth(record, k).
  template <typename Growth>
  ComplexGrid byLength(Growth growth) const;
  const RadarConfig& radar_;
  const std::vector<PathRecord>& records_;
};

}  // namespace mmradartwin
