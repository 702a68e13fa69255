#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <vector>

#include "mmradartwin_dsp/cfar.h"
#include "mmradartwin_dsp/ros/strict_parameters.h"

namespace mmradartwin {

/// The parameters cfar_kind, cfar_false_alarm_rate and so on. Throws InputError, also where they do not fit each other.
CfarSettings readCfarSettings(StrictParameters& parameters);

/// Detections as a cloud in the frame of their map, whose plane z = 0 they lie in: x, y, z, snr_db, range_m,
/// azimuth_deg, radial_speed_m_s, power_db, all float32. The speed alone may be NaN.
sensor_msgs::PointCloud2 toCloud(const std::vector<Detection>& detections, const std_msgs::Header& header);
/// The same back, in bins of these axes. Throws InputError where a field is missing or of another type.
std::vector<Detection> fromCloud(const sensor_msgs::PointCloud2& cloud, const RangeAngleAxes& axes);

}  // namespace mmradartwin
