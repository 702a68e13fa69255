#pragma once

#include <cstdint>
#include <string>

#include "mmradartwin_driver/pcap_reader.h"

namespace mmradartwin {

struct PacketReplayOptions {
  std::string host_ip = "127.0.0.1";  ///< where a driver listens
  std::string card_ip = "127.0.0.2";  ///< an address of this host that the packets come from
  std::uint16_t data_port = kDca1000DataPort;
  std::uint16_t source_port = 1024;  ///< as the card's
  PcapSource recorded;               ///< in the file
  double rate = 1;                   ///< times the recorded pace
};

/// Sends the data packets of a packet capture again, each as it was and when it was due by the recording's times: with
/// its losses, its order and its pauses. For a driver that leaves the card alone (configure_card false). Returns how
/// many. Throws InputError (no such file, no data packets, those of several cards, addresses and rate that cannot be),
/// RigError (the network).
std::uint64_t replayPackets(const std::string& file, const PacketReplayOptions& options);

}  // namespace mmradartwin
