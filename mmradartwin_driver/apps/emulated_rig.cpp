// Whole rig without hardware: an emulated AWR2243 on an emulated USB bus and an emulated DCA1000 on its own network.
// Programs started by with_emulated_usb see the radar.
#include "../emulator/emulated_rig.h"

#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "emulator_program.h"
#include "mmradartwin_dsp/input_error.h"

namespace {

namespace fs = std::filesystem;

/// Folder of a running rig: `usb` (the bus), `pid`, and `control`, a socket that takes commands.
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
    std::ofstream(path_ / "pid") << getpid() << "\n";  // last: the rig can be used from now on
  }
  ~RunFolder() {
    close(fd_);
    clear();
  }
  /// Next command; empty where none waits.
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
  EmulatedRig::Options options;
  bool no_firmware = false;
  app.add_option("session", session_path, "session directory")->required();
  mmradartwin::EmulatorProgram program(app, options.card);
  app.add_option("--run-folder", folder, "where with_emulated_usb and the control socket find this rig")
      ->capture_default_str();
  app.add_option("--interface", options.interface, "this host's end of the cable")->capture_default_str();
  app.add_flag("--loopback", options.loopback, "no network of its own: both addresses are this host's");
  app.add_flag("--once", options.lanes.once, "end with the session instead of beginning it anew");
  app.add_flag("--no-firmware", no_firmware, "the radar's flash is empty");
  app.add_flag("--lanes-reversed", options.lanes.lanes_reversed, "wiring fault: lane k carries receiver 3 - k");
  app.add_flag("--iq-swapped", options.lanes.iq_swapped, "wiring fault: Q comes before I");
  app.footer("Example: emulated_rig lab --loopback");
  return program.run(argc, argv, [&] {
    options.firmware_in_flash = !no_firmware;
    signal(SIGPIPE, SIG_IGN);
    const auto session = program.open(session_path, "");
    EmulatedRig rig(session, options, [&program](const std::string& line) { program.log(line); });
    const RunFolder run(folder, rig.usb_root());
    program.log("ready poses=" + std::to_string(session.poses.size()) + " frames=" + std::to_string(session.frames) +
                " card=" + options.card.card_ip);
    while (!program.interrupted() && !rig.completed()) {
      rig.serve(50);
      const std::string command = run.command();
      const std::string wrong = command.empty() ? "" : rig.handle(command);
      if (!wrong.empty()) program.log("error: " + command + ": " + wrong);
    }
    // The host answers the end of a recording with RECORD_STOP.
    for (int i = 0; i < 10 && !program.interrupted(); ++i) rig.serve(100);
    return session.problems.empty() ? 0 : 2;
  });
}
