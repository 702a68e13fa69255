#pragma once

#include <cstdint>
#include <string>

#include "mmradartwin_driver/pcap_reader.h"

namespace mmradartwin {

struct PacketReplayOptions {
  std::string host_ip = "127.0.0.1";  ///< where a driver listens
  std::string card_ip = "127.0.0.2";  ///< an address of this host from which the packets are sent
  std::uint16_t data_port = kDca1000DataPort;
  std::uint16_t source_port = 1024;  ///< as the card's
  PcapSource recorded;               ///< in the file
  double rate = 1;                   ///< multiple of the recorded pace
};

/// Sends the data packets of a packet capture again at the recorded times, with their losses, order and pauses. For a
/// driver that does not configure the card (configure_card false). Returns the number of packets. Throws InputError
/// (missing file, no data packets, those of several cards, impossible addresses or rate), RigError (network).
std::uint64_t replayPackets(const std::string& file, const PacketReplayOptions& options);

}  // namespace mmradartwin
