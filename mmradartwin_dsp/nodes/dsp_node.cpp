#include <ros/ros.h>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/ros/signal_chain_node.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "signal_chain");
  const ros::NodeHandle keep_alive;  // with the last handle the console goes, and the error below with it
  try {
    const mmradartwin::SignalChainNode node{ros::NodeHandle(), ros::NodeHandle("~")};
    const mmradartwin::MasterWatch master_watch;
    ros::spin();
  } catch (const mmradartwin::InputError& error) {
    ROS_FATAL("%s", error.what());
    return 2;
  }
  return 0;
}
