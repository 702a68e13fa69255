#include "card_network.h"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <stdexcept>
#include <thread>

namespace mmradartwin {
namespace {

/// Output of the command, both streams; throws where it fails.
std::string shell(const std::string& command) {
  FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  if (!pipe) throw std::runtime_error(command + ": cannot be run");
  std::string output;
  char part[256];
  while (std::fgets(part, sizeof part, pipe)) output += part;
  if (pclose(pipe) != 0) throw std::runtime_error(command + ": " + output);
  return output;
}

void onThread(const std::function<void()>& action) {
  std::exception_ptr failure;
  std::thread thread([&] {
    try {
      action();
    } catch (...) {
      failure = std::current_exception();
    }
  });
  thread.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace

CardNetwork::CardNetwork(const Options& options) : options_(options) {
  const std::string card_side = options_.interface + "-c";
  // A port of a rig that has just ended is taken down by the kernel a moment later.
  for (int i = 0; i < 50; ++i) {
    if (access(("/sys/class/net/" + options_.interface).c_str(), F_OK) != 0) break;
    if (i == 49) {
      throw std::runtime_error("the network port " + options_.interface +
                               " exists already: another emulated rig runs; end it first");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  const std::string taken = shell("ip -4 -o addr show to " + options_.host_ip + "/32");
  if (!taken.empty()) {
    throw std::runtime_error("this host has the address " + options_.host_ip +
                             " already, as for a real card: take it away (ip addr del), or give --host-ip and "
                             "--card-ip of another network; it is on " +
                             taken);
  }
  const std::string host = std::to_string(getpid());
  onThread([&] {
    if (unshare(CLONE_NEWNET) != 0) {
      throw std::runtime_error(std::string("no network namespace for the emulated card: ") + std::strerror(errno) +
                               "; run as root, or use --loopback");
    }
    namespace_fd_ = open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC);
    shell("ip link add " + card_side + " type veth peer name " + options_.interface + " netns " + host);
    shell("ip addr add " + options_.card_ip + "/24 dev " + card_side);
    shell("ip link set lo up");
    shell("ip link set " + card_side + " up");
  });
  try {
    shell("ip addr add " + options_.host_ip + "/24 dev " + options_.interface);
    shell("ip link set " + options_.interface + " up");
  } catch (...) {
    close(namespace_fd_);
    throw;
  }
}

CardNetwork::~CardNetwork() {
  try {
    shell("ip link del " + options_.interface);
  } catch (const std::runtime_error&) {
    // It goes with the namespace.
  }
  close(namespace_fd_);
}

void CardNetwork::run(const std::function<void()>& action) const {
  onThread([&] {
    if (setns(namespace_fd_, CLONE_NEWNET) != 0) {
      throw std::runtime_error(std::string("the card's namespace cannot be entered: ") + std::strerror(errno));
    }
    action();
  });
}

void CardNetwork::setCable(bool in) const {
  run([&] { shell("ip link set " + options_.interface + "-c " + (in ? "up" : "down")); });
}

}  // namespace mmradartwin
