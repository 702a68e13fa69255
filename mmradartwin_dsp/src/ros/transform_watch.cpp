#include "mmradartwin_dsp/ros/transform_watch.h"

#include "mmradartwin_dsp/ros/tf_warning_count.h"

namespace mmradartwin {

TransformWatch::TransformWatch(ros::NodeHandle& nh) {
  using Event = ros::MessageEvent<tf2_msgs::TFMessage const>;
  const auto taking = [this](bool fixed) -> boost::function<void(const Event&)> {
    return [this, fixed](const Event& event) { take(event, fixed); };
  };
  moving_ = nh.subscribe<tf2_msgs::TFMessage>("/tf", 100, taking(false));
  fixed_ = nh.subscribe<tf2_msgs::TFMessage>("/tf_static", 100, taking(true));
  countTfWarningsOfProcess();
}

void TransformWatch::take(const ros::MessageEvent<tf2_msgs::TFMessage const>& event, bool fixed) {
  for (const std::string& contradiction : sources_.add(*event.getConstMessage(), fixed, event.getPublisherName())) {
    ROS_WARN("tf contradicts itself: %s", contradiction.c_str());
  }
}

}  // namespace mmradartwin
