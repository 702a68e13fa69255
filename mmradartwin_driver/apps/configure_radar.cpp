// Brings an AWR2243 up from radar.yaml over USB and runs its frames until it is interrupted: for recording without ROS,
// and to see what the radar says.
#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>
#include <thread>

#include "mmradartwin_driver/awr2243_link.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/radar_config.h"

namespace {

volatile std::sig_atomic_t interrupted = 0;

}  // namespace

int main(int argc, char** argv) {
  using namespace mmradartwin;
  CLI::App app{
      "Configures an AWR2243 over USB and runs its frames until Ctrl-C. Prints the radar.yaml with the values that the "
      "device uses."};
  std::string radar_file, firmware;
  double duration_s = 0;
  bool check_only = false;
  app.add_option("radar", radar_file, "radar.yaml, with the optional keys that configure a device")->required();
  app.add_option("--firmware", firmware, "TI's meta image, for a radar with an empty flash");
  app.add_option("--duration-s", duration_s, "ends after so many seconds; 0: at Ctrl-C")->check(CLI::Range(0.0, 1e6));
  app.add_flag("--check", check_only, "prints the values, and leaves the radar alone");
  return runProgram(app, argc, argv, [&] {
    const RadarConfig radar = loadRadarConfig(radar_file);
    const Awr2243Registers registers = quantiseAwr2243(radar, radar_file);
    std::fputs(toYaml(withQuantisedValues(radar, registers)).c_str(), stdout);
    std::fflush(stdout);
    if (check_only) return 0;
    std::signal(SIGINT, [](int) { interrupted = 1; });
    std::signal(SIGTERM, [](int) { interrupted = 1; });
    Awr2243Link link(registers, firmware, [](const awr2243::EventText& event, const SubBlock&) {
      std::fprintf(stderr, "%s\n", event.text.c_str());
    });
    link.prepare();
    std::fprintf(stderr, "radar firmware %s\n", link.version().c_str());
    link.start();
    const auto started = std::chrono::steady_clock::now();
    while (!interrupted) {
      link.poll();
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - started;
      if (duration_s > 0 && elapsed.count() >= duration_s) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    link.stop();
    return 0;
  });
}
