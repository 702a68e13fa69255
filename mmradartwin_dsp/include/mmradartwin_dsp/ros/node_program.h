#pragma once

#include <ros/message_traits.h>
#include <ros/service_traits.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/ros/strict_parameters.h"

namespace mmradartwin {

/// A topic or service, as --help shows it.
struct ChannelDescription {
  std::string name, type, meaning;
};

template <typename Message>
ChannelDescription topic(const std::string& name, const std::string& meaning) {
  return {name, ros::message_traits::datatype<Message>(), meaning};
}

template <typename Service>
ChannelDescription service(const std::string& name, const std::string& meaning) {
  return {name, ros::service_traits::datatype<Service>(), meaning};
}

/// What a node does, and what it can be told: its --help.
struct NodeDescription {
  std::string program;  ///< as rosrun knows it
  std::string name;     ///< in the graph, where nobody gives it another
  std::string purpose;
  std::vector<ChannelDescription> subscribes, publishes, services;
  std::function<void(StrictParameters&)> parameters;  ///< reads them as the node does
};

/// The text of --help. Sections "Subscribes:", "Publishes:", "Services:" and "Parameters:" stand in this order, with a
/// line for each entry, "  NAME (TYPE...): MEANING", or "  none".
std::string helpOf(const NodeDescription& description);

/// The main() of a node. --help and --version answer before any master is asked. Else roscpp is started, and what `run`
/// throws becomes one line and the exit status: 2 for an InputError, else 1. Nodes wait for a master as long as it
/// takes; with `master_within_s` it has to answer by then.
int runNode(int argc, char** argv, const NodeDescription& description, const std::function<int()>& run,
            std::optional<double> master_within_s = std::nullopt);

}  // namespace mmradartwin
