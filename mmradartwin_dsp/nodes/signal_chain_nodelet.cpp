#include <nodelet/nodelet.h>
#include <ros/ros.h>  // nodelet.h needs it before itself

#include <memory>
#include <pluginlib/class_list_macros.hpp>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/ros/signal_chain_node.h"

namespace mmradartwin_dsp {

class SignalChainNodelet : public nodelet::Nodelet {
 private:
  void onInit() override {
    try {
      node_ = std::make_unique<mmradartwin::SignalChainNode>(getNodeHandle(), getPrivateNodeHandle());
      master_watch_ = std::make_unique<mmradartwin::MasterWatch>(getPrivateNodeHandle().getNamespace());
    } catch (const mmradartwin::InputError& error) {
      NODELET_FATAL("%s", error.what());
      throw;
    }
  }

  std::unique_ptr<mmradartwin::SignalChainNode> node_;
  std::unique_ptr<mmradartwin::MasterWatch> master_watch_;
};

}  // namespace mmradartwin_dsp

PLUGINLIB_EXPORT_CLASS(mmradartwin_dsp::SignalChainNodelet, nodelet::Nodelet)
