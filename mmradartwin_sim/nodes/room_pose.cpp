#include <ros/ros.h>

#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/ros/node_program.h"
#include "mmradartwin_sim/ros/room_pose_node.h"

int main(int argc, char** argv) {
  using mmradartwin::RoomPoseNode;
  return mmradartwin::runNode(argc, argv, RoomPoseNode::description(), [] {
    const RoomPoseNode node{ros::NodeHandle(), ros::NodeHandle("~")};
    const mmradartwin::MasterWatch master_watch;
    ros::spin();
    return 0;
  });
}
