// A whole rig without hardware: an emulated AWR2243 on an emulated USB bus and an emulated DCA1000 on a network of its
// own. Programs see the radar when they are started by with_emulated_usb.
#include "../emulator/emulated_rig.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <mutex>

#include "mmradartwin_dsp/input_error.h"

namespace {

namespace fs = std::filesystem;

volatile sig_atomic_t interrupted = 0;

/// The folder in which a running rig is found: `usb` (the bus), `pid`, and `control`, a socket that takes commands.
class RunFolder {
 public:
  RunFolder(const fs::path& path, const std::string& usb_root) : path_(path) {
    fs::create_directories(path_);
    clear();
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string control = (path_ / "control").string();
    if (control.size() >= sizeof address.sun_path) {
      throw mmradartwin::InputError("--run-folder " + path_.string() + ": too long for a socket; choose a shorter one");
    }
    std::strcpy(address.sun_path, control.c_str());
    fd_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd_ < 0 || bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error(control + ": " + std::strerror(errno));
    }
    fs::create_directory_symlink(usb_root, path_ / "usb");
    std::ofstream(path_ / "pid") << getpid() << "\n";  // last: now it can be used
  }
  ~RunFolder() {
    close(fd_);
    clear();
  }
  /// Empty where no command waits.
  std::string command() const {
    char text[256];
    const ssize_t size = recv(fd_, text, sizeof text, 0);
    std::string command(text, size > 0 ? static_cast<std::size_t>(size) : 0);
    while (!command.empty() && command.back() == '\n') command.pop_back();
    return command;
  }

 private:
  void clear() const {
    for (const char* name : {"pid", "usb", "control"}) fs::remove(path_ / name);
  }
  fs::path path_;
  int fd_ = -1;
};

std::string defaultFolder() {
  const char* const ros_home = std::getenv("ROS_HOME");
  const char* const home = std::getenv("HOME");
  return ros_home ? std::string(ros_home) + "/emulated_rig" : std::string(home ? home : "/tmp") + "/.ros/emulated_rig";
}

}  // namespace

int main(int argc, char** argv) {
  using mmradartwin::EmulatedRig;
  CLI::App app{
      "Emulates an AWR2243BOOST on a DCA1000EVM: USB, LVDS and Ethernet. The radar sees the session's captures while "
      "its frames run. Needs root for the card's network, or --loopback."};
  std::string session_path, folder = defaultFolder();
  mmradartwin::PlayedSelection selection;
  EmulatedRig::Options options;
  bool no_firmware = false, end_with_parent = false;
  app.add_option("session", session_path, "session directory")->required();
  app.add_option("--first", selection.first, "index of the first pose")->check(CLI::NonNegativeNumber);
  app.add_option("--every", selection.every, "then every so-manieth pose")->check(CLI::PositiveNumber);
  app.add_option("--count", selection.count, "poses at most; 0: all")->check(CLI::NonNegativeNumber);
  app.add_option("--run-folder", folder, "where with_emulated_usb and the control socket find this rig")
      ->capture_default_str();
  app.add_option("--interface", options.interface, "this host's end of the cable")->capture_default_str();
  app.add_option("--card-ip", options.card.card_ip, "address of the card")->capture_default_str();
  app.add_option("--host-ip", options.card.host_ip, "address of this host on the card's network")
      ->capture_default_str();
  app.add_flag("--loopback", options.loopback, "no network of its own: both addresses are this host's");
  app.add_flag("--once", options.lanes.once, "end with the session instead of beginning it anew");
  app.add_flag("--no-firmware", no_firmware, "the radar's flash is empty");
  app.add_flag("--lanes-reversed", options.lanes.lanes_reversed, "wiring fault: lane k carries receiver 3 - k");
  app.add_flag("--iq-swapped", options.lanes.iq_swapped, "wiring fault: Q comes before I");
  app.add_option("--deaf-s", options.card.deaf_s, "silence after CONFIG_FPGA")->check(CLI::Range(0.0, 60.0));
  app.add_option("--flush-s", options.card.flush_s, "from the last sample to the short last packet")
      ->check(CLI::Range(0.0, 60.0));
  app.add_option("--loss", options.card.loss, "probability that a data packet is lost")->check(CLI::Range(0.0, 1.0));
  app.add_option("--jitter-us", options.card.jitter_us, "packets leave late by an exponential time of this mean")
      ->check(CLI::Range(0.0, 1e5));
  app.add_option("--stall-us", options.card.stall_us, "with --jitter-us: one packet in twenty by up to so much more")
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--seed", options.card.seed, "of these chances")->capture_default_str();
  app.add_flag("--end-with-parent", end_with_parent, "end when the program ends that started this one");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (end_with_parent) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() == 1) return 1;
  }
  options.firmware_in_flash = !no_firmware;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  std::mutex output;
  const auto log = [&output](const std::string& line) {
    const std::lock_guard<std::mutex> lock(output);
    std::printf("%s\n", line.c_str());
  };
  struct sigaction action {};
  action.sa_handler = [](int) { interrupted = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
  try {
    const auto session = mmradartwin::openPlayedSession(session_path, "", selection);
    for (const auto& problem : session.problems) {
      std::fprintf(stderr, "pose %s left out: %s\n", problem.pose.c_str(), problem.message.c_str());
    }
    EmulatedRig rig(session, options, log);
    const RunFolder run(folder, rig.usb_root());
    log("ready poses=" + std::to_string(session.poses.size()) + " frames=" + std::to_string(session.frames) +
        " card=" + options.card.card_ip);
    while (!interrupted && !rig.completed()) {
      rig.serve(50);
      const std::string command = run.command();
      const std::string wrong = command.empty() ? "" : rig.handle(command);
      if (!wrong.empty()) log("error: " + command + ": " + wrong);
    }
    // The host answers the end of a recording with RECORD_STOP.
    for (int i = 0; i < 10 && !interrupted; ++i) rig.serve(100);
    return session.problems.empty() ? 0 : 2;
  } catch (const mmradartwin::InputError& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
