#include <ros/ros.h>
// nodelet.h needs ros.h before it.
#include <nodelet/nodelet.h>

#include <memory>
#include <pluginlib/class_list_macros.hpp>

#include "mmradartwin_driver/ros/radar_driver.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/master_watch.h"

namespace mmradartwin {

class DriverNodelet : public nodelet::Nodelet {
 private:
  void onInit() override {
    try {
      driver_ = std::make_unique<RadarDriver>(getNodeHandle(), getPrivateNodeHandle());
      master_watch_ = std::make_unique<MasterWatch>(getPrivateNodeHandle().getNamespace());
    } catch (const InputError& error) {
      NODELET_FATAL_STREAM(error.what());
      throw;  // the load of the nodelet fails
    }
  }
  std::unique_ptr<RadarDriver> driver_;
  std::unique_ptr<MasterWatch> master_watch_;
};

}  // namespace mmradartwin

PLUGINLIB_EXPORT_CLASS(mmradartwin::DriverNodelet, nodelet::Nodelet)
