#pragma once

#include <mmradartwin_msgs/RangeAngleMap.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>

#include <memory>
#include <string>
#include <vector>

#include "mmradartwin_attribution/response.h"
#include "mmradartwin_dsp/cfar.h"
#include "mmradartwin_dsp/ros/strict_parameters.h"

namespace mmradartwin {

/// Detections as a cloud in the map's frame, whose plane z = 0 they lie in: x, y, z, snr_db, range_m, azimuth_deg, all
/// float32.
sensor_msgs::PointCloud2 toCloud(const std::vector<Detection>& detections, const std_msgs::Header& header);

/// radar/points, twin/points, attribution/detection_agreement: CFAR detections of measured and simulated maps, and how
/// they agree. What nobody listens to is not computed.
class DetectionPublisher {
 public:
  struct Settings {
    Settings() = default;
    explicit Settings(StrictParameters& parameters);

    CfarSettings cfar;
    double match_m = 0.5;
  };
  /// Throws InputError where settings do not fit each other.
  DetectionPublisher(ros::NodeHandle& nh, const Settings& settings);

  /// Throws InputError where the radar has no uniform line.
  void setRadar(const RadarConfig& radar);
  /// Of maps made with this radar; nothing before there is one. Both throw InputError for a map that contradicts
  /// itself.
  void publishMeasured(const mmradartwin_msgs::RangeAngleMap& measured);
  /// A simulated map has no noise of a receiver: its own is taken to be at least the measured map's floor, where both
  /// peaks among the evaluated cells are one level. Detections in those cells are compared.
  void publishPair(const EvaluationField& field, const mmradartwin_msgs::RangeAngleMap& measured,
                   const mmradartwin_msgs::RangeAngleMap& simulated);

 private:
  Settings settings_;
  std::unique_ptr<Cfar> cfar_;
  ros::Publisher measured_, simulated_, agreement_;
};

}  // namespace mmradartwin
