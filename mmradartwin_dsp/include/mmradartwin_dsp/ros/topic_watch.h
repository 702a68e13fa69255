#pragma once

#include <ros/ros.h>

#include <string>

namespace mmradartwin {

/// Since when a topic is silent, in words that name where to look.
class TopicWatch {
 public:
  /// `producer`: who publishes it, as the user knows it.
  explicit TopicWatch(std::string producer) : producer_(std::move(producer)) {}

  void heard() { heard_ = ros::WallTime::now(); }
  /// "" while the topic was heard within `limit_s`.
  std::string silence(const ros::Subscriber& subscriber, double limit_s = 2) const {
    const double silent_s = (ros::WallTime::now() - heard_).toSec();
    if (silent_s <= limit_s) return "";
    const std::string topic = subscriber.getTopic();
    if (subscriber.getNumPublishers() == 0) return "nobody publishes " + topic + ": look at " + producer_;
    return "nothing comes on " + topic + " for " + std::to_string(static_cast<long>(silent_s)) + " s: look at " +
           producer_;
  }

 private:
  std::string producer_;
  ros::WallTime heard_ = ros::WallTime::now();
};

}  // namespace mmradartwin
