#pragma once

#include <Eigen/Core>
#include <vector>

#include "mmradartwin_dsp/cfar.h"

namespace mmradartwin {

/// How two sets of detections of one place agree. NaN where a set that is divided by is empty.
struct DetectionAgreement {
  int measured = 0, simulated = 0;
  int matched = 0;       ///< pairs, each detection in one at most, the nearest first
  double precision = 0;  ///< share of the simulated detections that are matched
  double recall = 0;     ///< share of the measured detections that are matched
  /// Half the sum of two means: from each measured detection to the nearest simulated one, and the reverse.
  double chamfer_m = 0;
};

/// In the plane of the radar, x boresight and y left.
Eigen::Vector2d position_m(const Detection& detection);

/// Detections match where they are at most `radius_m` apart.
DetectionAgreement agreement(const std::vector<Detection>& measured, const std::vector<Detection>& simulated,
                             double radius_m);

}  // namespace mmradartwin
