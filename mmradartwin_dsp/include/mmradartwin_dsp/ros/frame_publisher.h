#pragma once

#include <mmradartwin_msgs/RangeDopplerMap.h>
#include <ros/ros.h>

#include <memory>
#include <string>

#include "mmradartwin_dsp/point_detector.h"
#include "mmradartwin_dsp/ros/map_publisher.h"

namespace mmradartwin {

/// radar/points and radar/range_doppler, for which the loops of a frame are needed one by one. What nobody listens to
/// is not computed. Where a radar's frames tell no speeds there is no range-Doppler map, which is said once, and points
/// have NaN for their speed. Speeds take half of the node's time at most: frames that come meanwhile go without points.
class FramePublisher {
 public:
  FramePublisher(ros::NodeHandle& nh, const CfarSettings& cfar);

  /// Throws InputError where the radar has no uniform line.
  void setRadar(const RadarConfig& radar);
  bool isWanted() const { return points_.getNumSubscribers() > 0 || range_doppler_.isWanted(); }
  /// Why there are no speeds; "" where there are.
  const std::string& whyNoSpeeds() const { return why_no_speeds_; }
  /// Of a frame and of the map of the average that it is the last of, with that one's header and pose. correction: null
  /// for none.
  void publish(const SignalChain& chain, const AdcCube& frame, const ChannelCorrection* correction,
               const mmradartwin_msgs::RangeAngleMap& average);

 private:
  CfarSettings cfar_;
  std::unique_ptr<PointDetector> detector_;
  std::string why_no_speeds_;
  bool told_ = false;         ///< why_no_speeds_, to who wanted a range-Doppler map
  ros::WallTime rest_until_;  ///< for the maps, which come first
  ros::Publisher points_;
  MapPublisher<mmradartwin_msgs::RangeDopplerMap> range_doppler_;
};

}  // namespace mmradartwin
