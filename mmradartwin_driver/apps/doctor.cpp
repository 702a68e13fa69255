// doctor: checks link, card, USB port and first samples, and says for each failure the next thing to do.
#include <CLI/CLI.hpp>
#include <iostream>

#include "mmradartwin_driver/rig_doctor.h"
#include "mmradartwin_dsp/program.h"

int main(int argc, char** argv) {
  using namespace mmradartwin;
  RigDoctorOptions options;
  std::string radar;
  bool no_usb = false;
  double buffer_mb = static_cast<double>(options.buffer_bytes >> 20);
  CLI::App app("Looks at everything between radar and this host. Stop the driver first: both need the same ports.");
  app.add_option("--radar", radar, "radar.yaml: arm the card and look at the first samples too");
  app.add_option("--host-ip", options.host_ip, "this host's address on the card's network")->capture_default_str();
  app.add_option("--card-ip", options.card_ip, "the card's address")->capture_default_str();
  app.add_option("--config-port", options.config_port, "command port")->capture_default_str();
  app.add_option("--data-port", options.data_port, "data port")->capture_default_str();
  app.add_option("--packet-delay-us", options.packet_delay_us, "as the driver's parameter packet_delay_us")
      ->capture_default_str();
  app.add_option("--first-packet-s", options.first_packet_s, "how long to wait for samples")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 600.0));
  app.add_option("--buffer-mb", buffer_mb, "receive buffer asked of the kernel")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1024.0));
  app.add_flag(
      "--self-test", options.self_test,
      "configure the radar over USB, and look at ramps and targets that the chip itself makes: order of lanes, of "
      "I and Q, sign of angles; the radar must be configured again afterwards");
  app.add_option("--firmware", options.radar_firmware,
                 "TI's meta image, for --self-test of a radar with an empty flash");
  app.add_flag("--no-usb", no_usb, "do not look for the radar's USB port");
  app.footer("Example: doctor --radar radar.yaml");
  return runProgram(app, argc, argv, [&] {
    if (!radar.empty()) options.radar = loadRadarConfig(radar);
    options.usb = !no_usb;
    options.buffer_bytes = static_cast<std::size_t>(buffer_mb * (1 << 20));
    int problems = 0;
    checkRig(options, [&problems](const CheckResult& result) {
      const char* mark = result.level == CheckResult::Level::kFine   ? " ok "
                         : result.level == CheckResult::Level::kNote ? "note"
                                                                     : "FAIL";
      std::cout << "[" << mark << "] " << result.subject << ": " << result.found << std::endl;
      if (!result.next.empty()) std::cout << "       next: " << result.next << std::endl;
      problems += result.level == CheckResult::Level::kProblem ? 1 : 0;
    });
    std::cout << (problems == 0 ? "all fine" : std::to_string(problems) + " thing(s) to do") << std::endl;
    return problems == 0 ? 0 : 2;
  });
}
