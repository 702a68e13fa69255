#include "mmradartwin_sim/ros/twin_node.h"

#include <ros/ros.h>

#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/ros/node_program.h"

int main(int argc, char** argv) {
  using mmradartwin::TwinNode;
  return mmradartwin::runNode(argc, argv, TwinNode::description(), [] {
    const TwinNode node{ros::NodeHandle(), ros::NodeHandle("~")};
    const mmradartwin::MasterWatch master_watch;
    ros::spin();
    return 0;
  });
}
