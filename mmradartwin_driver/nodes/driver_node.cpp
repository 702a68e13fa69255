#include <ros/ros.h>

#include "mmradartwin_driver/ros/radar_driver.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/master_watch.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "radar_driver");
  const ros::NodeHandle nh;  // outlives the node: roscpp stops printing with the last handle
  try {
    const mmradartwin::RadarDriver driver(nh, ros::NodeHandle("~"));
    const mmradartwin::MasterWatch master_watch;
    ros::spin();
  } catch (const mmradartwin::InputError& error) {
    ROS_FATAL_STREAM(error.what());
    return 2;
  }
  return 0;
}
