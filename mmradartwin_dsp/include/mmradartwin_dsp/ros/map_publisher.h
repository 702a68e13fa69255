#pragma once

#include <mmradartwin_msgs/RangeAngleMap.h>
#include <mmradartwin_msgs/RangeDopplerMap.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <sensor_msgs/Image.h>

#include <cstdint>
#include <string>

namespace mmradartwin {

/// Levels as a picture of encoding 32FC1, in the unit of the map: a row per range bin from the nearest on, a column per
/// angle or speed in the order of the message. Throws InputError where the map contradicts itself.
sensor_msgs::Image toImage(const mmradartwin_msgs::RangeAngleMap& map);
sensor_msgs::Image toImage(const mmradartwin_msgs::RangeDopplerMap& map);

/// A topic of maps, and beside it `TOPIC/image` with the same levels as pictures (toImage()).
template <typename Map>
class MapPublisher {
 public:
  MapPublisher() = default;
  MapPublisher(ros::NodeHandle& nh, const std::string& topic, std::uint32_t queue)
      : maps_(nh.advertise<Map>(topic, queue)), images_(nh.advertise<sensor_msgs::Image>(topic + "/image", queue)) {}
  bool isWanted() const { return maps_.getNumSubscribers() > 0 || images_.getNumSubscribers() > 0; }
  void publish(const boost::shared_ptr<const Map>& map) const {
    if (maps_.getNumSubscribers() > 0) maps_.publish(map);
    if (images_.getNumSubscribers() > 0) images_.publish(toImage(*map));
  }

 private:
  ros::Publisher maps_, images_;
};

}  // namespace mmradartwin
