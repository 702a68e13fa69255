// AWR2243BOOST without hardware: runs a command for which the capture card's RADAR_FTDI port is plugged in, with an
// emulated radar behind it. As a roslaunch prefix it gives the driver node its radar.
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "../emulator/emulated_usb_bus.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"

namespace mmradartwin {
namespace {

volatile pid_t child = 0;

void passOn(int signal) {
  if (child > 0) kill(child, signal);
}

/// Returns the command's exit status, as a shell tells it.
int runWithRadar(std::vector<std::string> command, bool with_firmware) {
  EmulatedAwr2243 radar(with_firmware);
  EmulatedFtdi chip(radar);
  EmulatedUsbBus bus(chip);
  bus.plug();
  const char* before = std::getenv("LD_PRELOAD");
  setenv("UMOCKDEV_DIR", bus.root().c_str(), 1);
  setenv("LD_PRELOAD", (std::string("libumockdev-preload.so.0") + (before ? std::string(":") + before : "")).c_str(),
         1);

  std::vector<char*> arguments;
  for (std::string& part : command) arguments.push_back(part.data());
  arguments.push_back(nullptr);
  std::signal(SIGINT, passOn);
  std::signal(SIGTERM, passOn);
  pid_t started = 0;
  if (const int error = posix_spawnp(&started, arguments[0], nullptr, nullptr, arguments.data(), environ)) {
    throw InputError(command.front() + ": " + std::strerror(error));
  }
  child = started;
  int status = 0;
  while (waitpid(started, &status, 0) < 0 && errno == EINTR) continue;
  for (const std::string& violation : radar.violations) std::fprintf(stderr, "radar: %s\n", violation.c_str());
  for (const std::string& violation : chip.violations) std::fprintf(stderr, "USB chip: %s\n", violation.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace
}  // namespace mmradartwin

int main(int argc, char** argv) {
  using namespace mmradartwin;
  CLI::App app{"Runs a command with an emulated AWR2243 on its USB bus."};
  app.prefix_command();
  app.allow_extras();
  bool no_firmware = false;
  app.add_flag("--no-firmware", no_firmware, "the radar's flash is empty");
  app.footer("The command follows the options.\nExample: awr2243_emulator configure_radar radar.yaml");
  return runProgram(app, argc, argv, [&] {
    std::vector<std::string> command = app.remaining();
    if (!command.empty() && command.front() == "--") command.erase(command.begin());
    if (command.empty()) throw InputError("no command; give the program that shall see the radar");
    return runWithRadar(command, !no_firmware);
  });
}
