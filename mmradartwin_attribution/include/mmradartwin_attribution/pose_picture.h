#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mmradartwin_attribution/evaluation.h"

namespace mmradartwin {

/// Colour of a class, blue, green, red 0..255: five hues of Okabe and Ito that stay apart under colour blindness.
cv::Scalar classColor_bgr(ResidualClass c);

/// Measured, simulated and residual fan of one pose side by side. White boxes: expected regions where both branches
/// respond strongly; magenta boxes: residuals, drawn on the branch that is stronger. Boxes name actors; below stands a
/// list of the residuals with class and levels.
cv::Mat drawPose(const EvaluationField& field, const PoseResult& result);

/// How drawPoseFans() draws.
struct PoseFanStyle {
  bool numbers = true;  ///< boxes of residuals bear their number in PoseAttribution::residuals, from 1 on
  double range_m = 0;   ///< that is shown; 0: shownRange_m()
};

/// Whole metres up to beyond the last response of a pose that matters.
double shownRange_m(const EvaluationField& field, const PoseResult& result);

/// The three fans of drawPose(), one by one and with letters that stay readable when they are shown small: measured,
/// simulated, difference.
std::array<cv::Mat, 3> drawPoseFans(const EvaluationField& field, const PoseResult& result,
                                    const PoseFanStyle& fan_style = {});

/// Acquisition coverage: the scene from above, coloured by material, with the radar's places and headings. Horizontal
/// surfaces above `cut_height_m` (a ceiling) are left out.
cv::Mat drawCoverage(const Scene& scene, const std::vector<Pose>& poses, double cut_height_m = 2.0);

/// What the report's pictures are drawn from.
struct ReportPictures {
  const EvaluationField* field = nullptr;  ///< of the evaluation; nullptr: no pictures of poses
  cv::Mat coverage;                        ///< drawCoverage(); empty: none
};

}  // namespace mmradartwin
