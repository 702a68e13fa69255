#include "mmradartwin_driver/listening_sockets.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

/// As the kernel writes a 32-bit word of an address: its bytes the other way round.
std::string ipv4(std::uint32_t word) {
  return std::to_string(word & 255) + "." + std::to_string(word >> 8 & 255) + "." + std::to_string(word >> 16 & 255) +
         "." + std::to_string(word >> 24);
}

/// "" for an address of loopback.
std::string outsideAddress(const std::string& hex) {
  const auto word = [&hex](std::size_t i) {
    return static_cast<std::uint32_t>(std::stoul(hex.substr(8 * i, 8), nullptr, 16));
  };
  if (hex.size() == 8) return (word(0) & 255) == 127 ? "" : ipv4(word(0));
  if (hex.size() != 32) return "";
  const bool of_ipv4 = word(0) == 0 && word(1) == 0 && word(2) == 0xffff0000;
  if (of_ipv4) return (word(3) & 255) == 127 ? "" : ipv4(word(3));
  if (word(0) == 0 && word(1) == 0 && word(2) == 0) {
    if (word(3) == 0) return "[::]";
    if (word(3) == 0x01000000) return "";
  }
  return "[" + hex + "]";
}

/// {inode: "ADDRESS:PORT/PROTOCOL"} of what others can reach.
std::map<std::string, std::string> openSockets(const fs::path& net) {
  std::map<std::string, std::string> open;
  for (const char* table : {"tcp", "tcp6", "udp", "udp6"}) {
    const std::string protocol = std::string(table).substr(0, 3);
    std::ifstream in(net / table);
    std::string line;
    std::getline(in, line);  // the columns' names
    while (std::getline(in, line)) {
      std::istringstream fields(line);
      std::string number, local, remote, state, queues, timer, retransmits, user, timeout, inode;
      fields >> number >> local >> remote >> state >> queues >> timer >> retransmits >> user >> timeout >> inode;
      const std::size_t colon = local.find(':');
      const bool waits = protocol == "tcp" ? state == "0A" : state == "07";
      if (!fields || colon == std::string::npos || !waits) continue;
      const std::string address = outsideAddress(local.substr(0, colon));
      if (address.empty()) continue;
      open[inode] = address + ":" + std::to_string(std::stoul(local.substr(colon + 1), nullptr, 16)) + "/" + protocol;
    }
  }
  return open;
}

/// Name of a ROS process by its command line, words apart by zeros; "" for any other.
std::string rosName(const std::string& command) {
  const std::size_t name = command.find("__name:=");
  if (name != std::string::npos) return command.substr(name + 8, command.find('\0', name) - name - 8);
  std::string word;
  std::istringstream words(command);
  while (std::getline(words, word, '\0')) {
    const std::string program = fs::path(word).filename().string();
    for (const char* known : {"rosmaster", "roscore", "roslaunch", "rosout"}) {
      if (program == known) return program;
    }
  }
  return "";
}

}  // namespace

std::vector<std::string> openRosSockets(const std::string& procfs) {
  const std::map<std::string, std::string> open = openSockets(fs::path(procfs) / "net");
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator process(procfs, error), end; !error && process != end; process.increment(error)) {
    const std::string id = process->path().filename().string();
    if (!std::all_of(id.begin(), id.end(), [](unsigned char c) { return std::isdigit(c); })) continue;
    std::ifstream in(process->path() / "cmdline", std::ios::binary);
    std::ostringstream command;
    command << in.rdbuf();
    const std::string name = rosName(command.str());
    if (name.empty()) continue;
    std::error_code unreadable;
    for (fs::directory_iterator fd(process->path() / "fd", unreadable); !unreadable && fd != end;
         fd.increment(unreadable)) {
      std::error_code gone;
      const std::string target = fs::read_symlink(fd->path(), gone).string();
      if (gone || target.rfind("socket:[", 0) != 0) continue;
      const auto socket = open.find(target.substr(8, target.size() - 9));
      if (socket != open.end()) found.push_back(name + " " + socket->second);
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace mmradartwin
