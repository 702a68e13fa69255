#include "mmradartwin_attribution/ros/attribution_node.h"

#include <ros/ros.h>

#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/ros/node_program.h"

int main(int argc, char** argv) {
  using mmradartwin::AttributionNode;
  return mmradartwin::runNode(argc, argv, AttributionNode::description(), [] {
    const AttributionNode node{ros::NodeHandle(), ros::NodeHandle("~")};
    const mmradartwin::MasterWatch master_watch;
    ros::spin();
    return 0;
  });
}
