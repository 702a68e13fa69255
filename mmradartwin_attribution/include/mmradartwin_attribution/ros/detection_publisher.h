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

/// twin/points, attribution/detection_agreement: CFAR detections of simulated maps, and how they agree with those of
/// measured ones. What nobody listens to is not computed.
class DetectionPublisher {
 public:
  struct Settings {
    Settings() = default;
    explicit Settings(StrictParameters& parameters);

    CfarSettings cfar;
    double match_m = 0.5;
  };
  DetectionPublisher(ros::NodeHandle& nh, const Settings& settings);

  /// Throws InputError where the radar has no uniform line.
  void setRadar(const RadarConfig& radar);
  /// Of maps made with this radar; nothing before there is one. Throws InputError for a map that contradicts itself.
  /// A simulated map has no noise of a receiver: its own is taken to be at least the measured map's floor, where both
  /// peaks among the evaluated cells are one level. Detections in those cells are compared.
  void publishPair(const EvaluationField& field, const mmradartwin_msgs::RangeAngleMap& measured,
                   const mmradartwin_msgs::RangeAngleMap& simulated);

 private:
  Settings settings_;
  std::unique_ptr<Cfar> cfar_;
  ros::Publisher simulated_, agreement_;
};

}  // namespace mmradartwin
