#include "card_network.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <sched.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

/// Runs `ip` with these arguments, without a shell. Returns its output, both streams; throws where it fails.
std::string ip(const std::vector<std::string>& arguments) {
  std::string command = "ip";
  std::vector<char*> argv{command.data()};
  std::string shown = "ip";
  for (const std::string& argument : arguments) {
    shown += " " + argument;
    argv.push_back(const_cast<char*>(argument.c_str()));
  }
  argv.push_back(nullptr);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(std::string("no pipe: ") + std::strerror(errno));
  posix_spawn_file_actions_t streams;
  posix_spawn_file_actions_init(&streams);
  posix_spawn_file_actions_adddup2(&streams, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&streams, ends[1], STDERR_FILENO);
  pid_t pid = -1;
  const int error = posix_spawnp(&pid, "ip", &streams, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&streams);
  close(ends[1]);
  std::string output;
  char part[256];
  for (ssize_t size = 0; error == 0 && (size = read(ends[0], part, sizeof part)) != 0;) {
    if (size > 0) {
      output.append(part, static_cast<std::size_t>(size));
    } else if (errno != EINTR) {
      break;
    }
  }
  close(ends[0]);
  if (error != 0) throw std::runtime_error(shown + ": " + std::strerror(error) + "; install iproute2");
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (status != 0) throw std::runtime_error(shown + ": " + output);
  return output;
}

/// Throws for what the kernel would not take, or `ip` would take for something else.
void check(const CardNetwork::Options& options) {
  for (const std::string& address : {options.host_ip, options.card_ip}) {
    in_addr parsed{};
    if (inet_pton(AF_INET, address.c_str(), &parsed) != 1) {
      throw InputError("'" + address + "' is no IPv4 address: write it like 192.168.33.30");
    }
  }
  const std::string& name = options.interface;
  const auto allowed = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  if (name.empty() || name.size() > 13 || !std::all_of(name.begin(), name.end(), allowed)) {
    throw InputError("interface '" + name + "': 1 to 13 of a-z, 0-9 and _ are allowed");
  }
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
  check(options_);
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
  const std::string taken = ip({"-4", "-o", "addr", "show", "to", options_.host_ip + "/32"});
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
    ip({"link", "add", card_side, "type", "veth", "peer", "name", options_.interface, "netns", host});
    ip({"addr", "add", options_.card_ip + "/24", "dev", card_side});
    ip({"link", "set", "lo", "up"});
    ip({"link", "set", card_side, "up"});
  });
  try {
    ip({"addr", "add", options_.host_ip + "/24", "dev", options_.interface});
    ip({"link", "set", options_.interface, "up"});
  } catch (...) {
    close(namespace_fd_);
    throw;
  }
}

CardNetwork::~CardNetwork() {
  try {
    ip({"link", "del", options_.interface});
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
  run([&] { ip({"link", "set", options_.interface + "-c", in ? "up" : "down"}); });
}

}  // namespace mmradartwin
