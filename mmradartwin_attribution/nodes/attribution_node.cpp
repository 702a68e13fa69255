#include "mmradartwin_attribution/ros/attribution_node.h"

#include <ros/ros.h>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/master_watch.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "attribution");
  const ros::NodeHandle nh;  // outlives the node: with the last handle gone, roscpp prints nothing any more
  try {
    const mmradartwin::AttributionNode node{nh, ros::NodeHandle("~")};
    const mmradartwin::MasterWatch master_watch;
    ros::spin();
  } catch (const mmradartwin::InputError& error) {
    ROS_FATAL("%s", error.what());
    return 2;
  }
  return 0;
}
