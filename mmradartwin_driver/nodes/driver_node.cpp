#include <ros/ros.h>

#include "mmradartwin_driver/ros/radar_driver.h"
#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/ros/node_program.h"

int main(int argc, char** argv) {
  using mmradartwin::RadarDriver;
  return mmradartwin::runNode(argc, argv, RadarDriver::description(), [] {
    const RadarDriver driver(ros::NodeHandle(), ros::NodeHandle("~"));
    const mmradartwin::MasterWatch master_watch;
    ros::spin();
    return 0;
  });
}
