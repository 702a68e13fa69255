#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace mmradartwin {

struct MasterAddress {
  std::string uri, host;
  std::uint32_t port = 0;
};

/// Of the ROS master, by __master:= among the arguments or ROS_MASTER_URI. InputError where that is none: ros::init()
/// would abort.
MasterAddress masterAddress(int argc, const char* const* argv);

/// True as soon as the master answers; false after so many seconds, or once `stop` says true. Something that takes
/// connections and never answers is none. To be asked before ros::init(), which waits without end where parameters are
/// given.
bool masterAnswers(const MasterAddress& master, double within_s, const std::function<bool()>& stop = {});

/// What to say where none answers.
std::string noMasterAnswers(const MasterAddress& master);

}  // namespace mmradartwin
