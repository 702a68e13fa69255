#pragma once

#include <string>

namespace mmradartwin {

/// True for a file that begins as a ROS 1 bag does, whatever its name is.
bool isBag(const std::string& file);
/// "" or which other recording of messages a file or folder is, with what to do: one of ROS 2, a bag of the first ROS.
std::string whyNoBag(const std::string& path);

}  // namespace mmradartwin
