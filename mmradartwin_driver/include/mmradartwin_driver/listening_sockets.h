#pragma once

#include <string>
#include <vector>

namespace mmradartwin {

/// Sockets of ROS processes that others than this computer can reach, as "NAME ADDRESS:PORT/PROTOCOL": TCP that
/// listens, UDP that is bound, at addresses that are not loopback. `procfs` is where the kernel tells; of processes of
/// other users only root is told.
std::vector<std::string> openRosSockets(const std::string& procfs);

}  // namespace mmradartwin
