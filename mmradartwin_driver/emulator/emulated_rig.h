#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "card_network.h"
#include "emulated_card.h"
#include "emulated_lvds.h"
#include "emulated_usb_bus.h"

namespace mmradartwin {

/// A whole rig: an AWR2243 on the USB bus of umockdev, its LVDS ribbon, and a DCA1000 on a network of its own. The
/// radar's start command makes the card stream.
class EmulatedRig {
 public:
  struct Options {
    bool loopback = false;  ///< card_ip is this host's own; otherwise a namespace is made, which needs root
    std::string interface = "mmrcard";
    bool firmware_in_flash = true;
    EmulatedCard::Options card;
    EmulatedLvds::Options lanes;
  };
  using Log = std::function<void(const std::string&)>;

  /// Throws std::runtime_error.
  EmulatedRig(const PlayedSession& session, const Options& options, Log log);
  ~EmulatedRig();

  void serve(int timeout_ms);  ///< commands to the card, for up to so long
  /// What people do to a rig: "cable out|in" (Ethernet), "usb out|in", "ribbon out|in", "card off|on" (its power, the
  /// USB chip's with it), "event HEX" (of the radar, with 20 bytes of zeros). Returns what is wrong with the command.
  std::string handle(const std::string& command);
  bool completed() const { return card_ && card_->completed(); }
  std::string usb_root() const { return bus_.root(); }

 private:
  void powerCard(bool on);

  Options options_;
  Log log_;
  EmulatedLvds lanes_;
  EmulatedAwr2243 radar_;
  EmulatedFtdi chip_{radar_};
  EmulatedUsbBus bus_{chip_};
  std::optional<CardNetwork> network_;
  std::unique_ptr<EmulatedCard> card_;
};

}  // namespace mmradartwin
