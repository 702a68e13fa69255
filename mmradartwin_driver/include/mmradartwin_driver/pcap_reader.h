#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "mmradartwin_driver/dca1000_protocol.h"

namespace mmradartwin {

/// Ports of a DCA1000's traffic in a packet capture (pcap or pcapng; Ethernet, Linux "any" or raw IP).
struct PcapPorts {
  std::uint16_t config = kDca1000ConfigPort;
  std::uint16_t data = kDca1000DataPort;
};
struct PcapVisitor {
  std::function<void(const DataPacket&)> data;                            ///< to the host's data port
  std::function<void(const Dca1000Reply&, std::int64_t stamp_ns)> reply;  ///< to the host's command port, status too
};
struct PcapCounters {
  std::uint64_t frames = 0;  ///< in the file
  std::uint64_t data = 0;
  std::uint64_t replies = 0;
  std::uint64_t other = 0;  ///< not UDP over IPv4 to one of the two ports, fragments, malformed
};
/// Reads the whole file in order. Throws InputError: no such file, no packet capture, truncated file (after visiting
/// all complete packets).
PcapCounters readPcap(const std::string& file, const PcapVisitor& visitor, const PcapPorts& ports = {});

}  // namespace mmradartwin
