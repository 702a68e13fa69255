#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_driver/check_result.h"
#include "mmradartwin_driver/dca1000_protocol.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

struct RigDoctorOptions {
  std::string host_ip = "192.168.33.30";
  std::string card_ip = "192.168.33.180";
  std::uint16_t config_port = kDca1000ConfigPort;
  std::uint16_t data_port = kDca1000DataPort;
  std::optional<RadarConfig> radar;  ///< without it the card is not armed, and samples are not looked at
  double packet_delay_us = 25;
  double first_packet_s = 5;             ///< longest wait for samples
  std::size_t buffer_bytes = 32u << 20;  ///< of the data socket
  bool usb = true;                       ///< look for the radar's USB port
  /// Configure the radar (`radar` with the keys for that) and let the chip make samples up. Afterwards it must be
  /// configured again.
  bool self_test = false;
  std::string radar_firmware;  ///< image for a radar whose flash is empty, with self_test
  std::string sysfs = "/sys", devfs = "/dev", procfs = "/proc", etc = "/etc";
};

/// Looks at everything between the radar and this host, from the host outwards, and reports each result as it comes.
/// What cannot be looked at because of an earlier problem is left out. Arms the card, and stops it again, where `radar`
/// is given. Returns true where nothing is left to do. Throws InputError for options that make no sense.
bool checkRig(const RigDoctorOptions& options, const std::function<void(const CheckResult&)>& report);

/// What may stand in the way of datagrams among these rules; empty where nothing seems to. `nft`: output of
/// "nft list ruleset", `iptables`: of "iptables -S", `ufw`: text of /etc/ufw/ufw.conf.
std::string firewallHint(const std::string& nft, const std::string& iptables, const std::string& ufw);

/// Are the first frame's bytes, as captured, what this radar would send? Finds lanes that are all zero although their
/// receivers are in use.
CheckResult checkLanes(const RadarConfig& radar, const std::vector<std::uint8_t>& frame);

/// Did `bytes` of samples come in `elapsed_s` as radar.yaml says?
CheckResult checkRate(const RadarConfig& radar, double bytes, double elapsed_s);

}  // namespace mmradartwin
