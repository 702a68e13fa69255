#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin {

/// Closed outline in polar coordinates with a label, drawn over a fan.
struct FanBox {
  double range_m, azimuth_rad;  ///< centre
  double half_range_m, half_azimuth_rad;
  cv::Scalar color_bgr;
  std::string label;
};

struct FanStyle {
  double min_db = -50, max_db = 0;  ///< colour limits
  bool normalise = true;            ///< to the peak beyond 0.16 m and within +-60 deg
  /// Residual maps: blue (negative) - white - red (positive), never normalised, limits made symmetric.
  bool diverging = false;
  double max_range_m = 10;
  int height_px = 600;
  double letters = 1;  ///< size of letters and of the margins that hold them, against the usual
  std::string title;
};

/// A fan seen from above (boresight up, left is left) with range arcs, spokes and a colour bar.
/// NaN cells and the sectors that the array cannot see are grey.
cv::Mat drawFan(const RangeAngleAxes& axes, const RealGrid& power_db, const FanStyle& style,
                const std::vector<FanBox>& boxes = {});
/// CSV `range_m,azimuth_deg,power_db`, a row per cell, not normalised.
void writeMapCsv(const RangeAngleMap& map, const std::string& file);
void writePicture(const cv::Mat& picture, const std::string& file);

}  // namespace mmradartwin
