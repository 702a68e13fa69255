#include "mmradartwin_dsp/ros/transform_reader.h"

#include <string>

#include "mmradartwin_dsp/ros/conversions.h"

namespace mmradartwin {

TransformReader::TransformReader(tf2_ros::Buffer& buffer) : buffer_(buffer) {
  using Event = ros::MessageEvent<tf2_msgs::TFMessage const>;
  const auto taking = [this](bool fixed) -> boost::function<void(const Event&)> {
    return [this, fixed](const Event& event) { take(event, fixed); };
  };
  nh_.setCallbackQueue(&queue_);
  moving_ = nh_.subscribe<tf2_msgs::TFMessage>("/tf", 100, taking(false));
  fixed_ = nh_.subscribe<tf2_msgs::TFMessage>("/tf_static", 100, taking(true));
  spinner_.start();
  buffer_.setUsingDedicatedThread(true);  // lookups may wait
}

TransformReader::~TransformReader() { spinner_.stop(); }

void TransformReader::measuredAt(const ros::Time& stamp) { measured_ns_ = toNanoseconds(stamp); }

void TransformReader::take(const ros::MessageEvent<tf2_msgs::TFMessage const>& event, bool fixed) {
  const ros::Time now = ros::Time::now();
  if (now < heard_) {
    ROS_WARN("time went back by %.3f s: tf begins anew", (heard_ - now).toSec());
    buffer_.clear();
  }
  heard_ = now;
  const std::string publisher = event.getPublisherName();
  const tf2_msgs::TFMessage kept =
      future_.leaveOut(*event.getConstMessage(), fixed, publisher, toRosTime(measured_ns_));
  future_count_ = future_.count();
  for (const geometry_msgs::TransformStamped& transform : kept.transforms) {
    buffer_.setTransform(transform, publisher, fixed);  // says itself what is wrong with one that it does not take
  }
}

}  // namespace mmradartwin
