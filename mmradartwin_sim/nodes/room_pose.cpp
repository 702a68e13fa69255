#include <ros/ros.h>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/ros/room_pose_node.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "room_pose");
  try {
    const mmradartwin::RoomPoseNode node{ros::NodeHandle(), ros::NodeHandle("~")};
    ros::spin();
  } catch (const mmradartwin::InputError& error) {
    ROS_FATAL("%s", error.what());
    return 2;
  }
  return 0;
}
