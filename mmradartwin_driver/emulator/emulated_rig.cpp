#include "emulated_rig.h"

#include <chrono>
#include <cstdlib>
#include <mutex>
#include <thread>

namespace mmradartwin {

EmulatedRig::EmulatedRig(const PlayedSession& session, const Options& options, Log log)
    : options_(options), log_(log), lanes_(session, options.lanes, log), radar_(options.firmware_in_flash) {
  if (!options_.loopback) {
    network_.emplace(CardNetwork::Options{options_.interface, options_.card.host_ip, options_.card.card_ip});
  }
  radar_.on_lanes = [this](const LvdsActivity& activity) { lanes_.set(activity); };
  powerCard(true);
}

EmulatedRig::~EmulatedRig() {
  bus_.unplug();
  for (const std::string& violation : radar_.violations) log_("error: radar: " + violation);
  for (const std::string& violation : chip_.violations) log_("error: USB chip: " + violation);
}

void EmulatedRig::powerCard(bool on) {
  if (!on) {
    bus_.unplug();
    card_.reset();
    return;
  }
  if (card_) return;
  const auto make = [this] { card_ = std::make_unique<EmulatedCard>(lanes_, options_.card, log_); };
  network_ ? network_->run(make) : make();
  bus_.plug();
}

void EmulatedRig::serve(int timeout_ms) {
  if (card_) {
    card_->serve(timeout_ms);
  } else {
    std::this_thread::sleep_for(std::chrono::milliseconds(timeout_ms));
  }
}

std::string EmulatedRig::handle(const std::string& command) {
  if (command == "usb out") {
    bus_.unplug();
  } else if (command == "usb in") {
    bus_.plug();
  } else if (command == "ribbon out" || command == "ribbon in") {
    lanes_.setRibbon(command == "ribbon in");
  } else if (command == "card off" || command == "card on") {
    powerCard(command == "card on");
  } else if (command == "cable out" || command == "cable in") {
    if (!network_) return "there is no cable on the loopback network";
    network_->setCable(command == "cable in");
  } else if (command.compare(0, 6, "event ") == 0) {
    const std::lock_guard<std::mutex> lock(chip_.mutex);
    radar_.raise(static_cast<std::uint16_t>(std::strtoul(command.c_str() + 6, nullptr, 16)),
                 std::vector<std::uint8_t>(20));
  } else {
    return "no such command; these are: cable out|in, usb out|in, ribbon out|in, card off|on, event HEX";
  }
  log_("done: " + command);
  return "";
}

}  // namespace mmradartwin
