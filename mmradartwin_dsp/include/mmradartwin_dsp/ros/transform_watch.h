#pragma once

#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include "mmradartwin_dsp/ros/transform_sources.h"

namespace mmradartwin {

/// Warns, beside a tf2_ros::TransformListener, when publishers of tf contradict each other, with their names; what tf2
/// says itself of transforms that it leaves out becomes one line a minute. Callbacks must come one at a time.
class TransformWatch {
 public:
  explicit TransformWatch(ros::NodeHandle& nh);

 private:
  void take(const ros::MessageEvent<tf2_msgs::TFMessage const>& event, bool fixed);

  TransformSources sources_;
  ros::Subscriber moving_, fixed_;
};

}  // namespace mmradartwin
