#pragma once

#include <vector>

#include "mmradartwin_attribution/response.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_sim/path_record.h"

namespace mmradartwin {

/// Sums over the evaluated cells of one pose, from which the share of the measured power that a twin explains follows
/// (docs/reference/contracts.md section 5).
struct ExplainedPower {
  double measured = 0, expected = 0;  ///< sums of power; measured against full scale, expected as simulated
  double cross = 0;                   ///< sum of the root of their product

  void add(const ExplainedPower& other);
  /// Amplitude gain that fits the simulation best to the measurement; 0 where nothing is expected.
  double amplitudeGain() const;
  /// 1 - sum (sqrt(measured) - gain sqrt(expected))^2 / sum measured; NaN where nothing was measured.
  double share(double amplitude_gain) const;
};

/// Expectation of a map's power over unknown phases of the paths: the sum of the powers that each puts into a cell
/// alone, [N][64], against full scale. NaN where the axes have no azimuth.
RealGrid expectedPower(const EvaluationField& field, const RadarConfig& radar, const std::vector<PathRecord>& records);

/// Sums over the central field. expected: as expectedPower() gives it, or empty for the power of `simulated`.
ExplainedPower explainedPower(const EvaluationField& field, const RangeAngleMap& measured,
                              const RangeAngleMap& simulated, const RealGrid& expected);

}  // namespace mmradartwin
