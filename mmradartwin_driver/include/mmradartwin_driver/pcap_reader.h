#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "mmradartwin_driver/dca1000_protocol.h"

namespace mmradartwin {

/// The wanted traffic in a packet capture (pcap or pcapng; Ethernet, Linux "any" or raw IP) of DCA1000s.
struct PcapSource {
  std::uint16_t config = kDca1000ConfigPort;
  std::uint16_t data = kDca1000DataPort;
  std::string card_ip;  ///< empty: of the one card that the file holds
};
struct PcapVisitor {
  std::function<void(const DataPacket&)> data;                            ///< to the host's data port
  std::function<void(const Dca1000Reply&, std::int64_t stamp_ns)> reply;  ///< to the host's command port, status too
};
struct PcapCounters {
  std::uint64_t frames = 0;  ///< in the file
  std::uint64_t data = 0;
  std::uint64_t replies = 0;
  std::uint64_t other = 0;  ///< not UDP over IPv4 to one of the two ports, fragments, malformed, of another card
  std::map<std::string, std::uint64_t> data_of_card;  ///< packets of samples by the address that sent them
};
/// Reads the whole file in order. Where no card is chosen, only the one that sends samples first is visited. Throws
/// InputError: no such file, no packet capture, no IPv4 address, truncated file (after visiting all complete packets).
PcapCounters readPcap(const std::string& file, const PcapVisitor& visitor, const PcapSource& source = {});

/// Throws InputError where the file has no samples that were asked for, or those of several cards and none was chosen
/// with `option`.
void demandOneCard(const std::string& file, const PcapCounters& counters, const PcapSource& source,
                   const std::string& option);

}  // namespace mmradartwin
