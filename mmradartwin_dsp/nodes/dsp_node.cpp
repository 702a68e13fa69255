#include <ros/ros.h>

#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/ros/node_program.h"
#include "mmradartwin_dsp/ros/signal_chain_node.h"

int main(int argc, char** argv) {
  using mmradartwin::SignalChainNode;
  return mmradartwin::runNode(argc, argv, SignalChainNode::description(), [] {
    const SignalChainNode node{ros::NodeHandle(), ros::NodeHandle("~")};
    const mmradartwin::MasterWatch master_watch;
    ros::spin();
    return 0;
  });
}
