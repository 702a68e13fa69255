#include "mmradartwin_attribution/ros/what_if_node.h"

#include <ros/ros.h>

#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/ros/node_program.h"

int main(int argc, char** argv) {
  using mmradartwin::WhatIfNode;
  return mmradartwin::runNode(argc, argv, WhatIfNode::description(), [] {
    const WhatIfNode node{ros::NodeHandle(), ros::NodeHandle("~")};
    const mmradartwin::MasterWatch master_watch;
    ros::spin();
    return 0;
  });
}
