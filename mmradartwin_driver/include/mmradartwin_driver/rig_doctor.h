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
  std::optional<RadarConfig> radar;  ///< without it the card is not armed and samples are not checked
  double packet_delay_us = 25;
  double first_packet_s = 5;             ///< longest wait for samples
  std::size_t buffer_bytes = 32u << 20;  ///< of the data socket
  bool usb = true;                       ///< check the radar's USB port
  /// Configures the radar (`radar` with the keys for that) and makes the chip generate samples. It must be configured
  /// again afterwards.
  bool self_test = false;
  std::string radar_firmware;  ///< image for a radar whose flash is empty, with self_test
  std::string sysfs = "/sys", devfs = "/dev", procfs = "/proc", etc = "/etc";
};

/// Checks everything between the radar and this host, from the host outwards, and reports each result as it comes.
/// Checks that an earlier problem prevents are left out. Arms and stops the card where `radar` is given. Returns true
/// where nothing is left to do. Throws InputError for contradictory options.
bool checkRig(const RigDoctorOptions& options, const std::function<void(const CheckResult&)>& report);

/// Firewall rule that may block datagrams; empty where there seems to be none. nft: output of "nft list ruleset";
/// iptables: of "iptables -S"; ufw: text of /etc/ufw/ufw.conf.
std::string firewallHint(const std::string& nft, const std::string& iptables, const std::string& ufw);

/// Checks that the first frame's bytes, as captured, are those of this radar. Finds lanes of zeros whose receivers are
/// in use.
CheckResult checkLanes(const RadarConfig& radar, const std::vector<std::uint8_t>& frame);

/// Checks that `bytes` of samples in `elapsed_s` agree with radar.yaml.
CheckResult checkRate(const RadarConfig& radar, double bytes, double elapsed_s);

}  // namespace mmradartwin
