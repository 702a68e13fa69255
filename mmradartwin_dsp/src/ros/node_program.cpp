#include "mmradartwin_dsp/ros/node_program.h"

#include <ros/ros.h>

#include <cstdio>
#include <exception>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program_version.h"
#include "mmradartwin_dsp/ros/wait_for_master.h"

namespace mmradartwin {
namespace {

void addChannels(const std::string& title, const std::vector<ChannelDescription>& channels, std::ostream& text) {
  text << '\n' << title << ":\n";
  for (const ChannelDescription& c : channels) text << "  " << c.name << " (" << c.type << "): " << c.meaning << '\n';
  if (channels.empty()) text << "  none\n";
}

}  // namespace

std::string helpOf(const NodeDescription& description) {
  std::ostringstream text;
  text << "usage: " << description.program << " [_PARAMETER:=VALUE ...] [TOPIC:=OTHER_TOPIC ...]\n\n"
       << description.purpose << "\n\n"
       << "The node's name is " << description.name << "; __name:=OTHER gives it another.\n"
       << "--help and --version print and end.\n";
  addChannels("Subscribes", description.subscribes, text);
  addChannels("Publishes", description.publishes, text);
  addChannels("Services", description.services, text);
  text << "\nParameters:\n";
  StrictParameters parameters;
  description.parameters(parameters);
  for (const ParameterDescription& p : parameters.descriptions()) {
    text << "  " << p.name << " (" << p.type
         << (p.default_value.empty() ? ", must be given" : ", default " + p.default_value)
         << (p.range.empty() ? "" : ", " + p.range) << "): " << p.meaning << '\n';
  }
  if (parameters.descriptions().empty()) text << "  none\n";
  return text.str();
}

int runNode(int argc, char** argv, const NodeDescription& description, const std::function<int()>& run,
            std::optional<double> master_within_s) {
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--help" || argument == "-h") {
      std::fputs(helpOf(description).c_str(), stdout);
      return 0;
    }
    if (argument == "--version") {
      std::printf("%s %s\n", description.program.c_str(), programVersion().c_str());
      return 0;
    }
    if (argument.find(":=") == std::string::npos) {
      std::fprintf(stderr, "error: '%s' is no NAME:=VALUE; run with --help for what this node knows\n",
                   argument.c_str());
      return 2;
    }
  }
  try {
    const MasterAddress master = masterAddress(argc, argv);
    if (master_within_s && !masterAnswers(master, *master_within_s)) throw InputError(noMasterAnswers(master));
  } catch (const InputError& error) {
    ROS_FATAL("%s", error.what());
    return 2;
  }
  ros::init(argc, argv, description.name);
  const ros::NodeHandle keep_alive;  // with the last handle the console goes, and the errors below with it
  try {
    return run();
  } catch (const InputError& error) {
    ROS_FATAL("%s", error.what());
    return 2;
  } catch (const std::exception& error) {
    ROS_FATAL("%s", error.what());
    return 1;
  }
}

}  // namespace mmradartwin
