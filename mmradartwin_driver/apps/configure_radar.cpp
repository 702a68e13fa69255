// Brings a radar up from radar.yaml over USB and runs its frames until it is interrupted: for recording without ROS,
// and to read the radar's events.
#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>
#include <thread>

#include "mmradartwin_driver/radar_devices.h"
#include "mmradartwin_driver/rig_error.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/radar_config.h"

namespace {

volatile std::sig_atomic_t interrupted = 0;

}  // namespace

int main(int argc, char** argv) {
  using namespace mmradartwin;
  CLI::App app{
      "Configures a radar over USB and runs its frames until Ctrl-C. Prints the radar.yaml with the values that the "
      "device uses."};
  std::string radar_file, firmware;
  double duration_s = 0;
  bool check_only = false;
  app.add_option("radar", radar_file, "radar.yaml, with the optional keys that configure a device")->required();
  app.add_option("--firmware", firmware, "TI's meta image, for a radar with an empty flash");
  app.add_option("--duration-s", duration_s, "ends after so many seconds; 0: at Ctrl-C")->check(CLI::Range(0.0, 1e6));
  app.add_flag("--check", check_only, "prints the values, and leaves the radar alone");
  app.footer("Example: configure_radar radar.yaml --check");
  return runProgram(app, argc, argv, [&] {
    const RadarConfig radar = loadRadarConfig(radar_file);
    const RadarDevice device = radarDevice(radar, radar_file);
    const RadarConfig quantised = device.quantised(radar, radar_file);
    std::fputs(toYaml(quantised).c_str(), stdout);
    std::fflush(stdout);
    if (check_only) return 0;
    std::signal(SIGINT, [](int) { interrupted = 1; });
    std::signal(SIGTERM, [](int) { interrupted = 1; });
    const auto control = device.control(quantised, firmware, [](RadarEvent::Level, const std::string& text) {
      std::fprintf(stderr, "%s\n", text.c_str());
    });
    control->configure();
    std::fprintf(stderr, "radar firmware %s\n", control->health().version.c_str());
    control->start();
    const auto started = std::chrono::steady_clock::now();
    while (!interrupted) {
      const std::string problem = control->health().problem;
      if (!problem.empty()) throw RigError(problem);
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - started;
      if (duration_s > 0 && elapsed.count() >= duration_s) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    control->stop();
    return 0;
  });
}
