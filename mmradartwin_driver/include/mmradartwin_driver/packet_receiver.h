#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mmradartwin_driver/datagram.h"
#include "mmradartwin_driver/dca1000_protocol.h"
#include "mmradartwin_driver/udp_socket.h"

namespace mmradartwin {

/// The data port: reads the card's datagrams in batches, with the kernel's receive time.
class PacketReceiver {
 public:
  struct Options {
    std::size_t buffer_bytes = 32u << 20;  ///< of the socket; holds 0.4 s at the card's highest rate
    int batch = 64;                        ///< largest number of datagrams read in one call
    /// Time for which dense packets gather in the socket before they are read, since a wake-up costs more than a
    /// packet. Stamps are the kernel's and do not change.
    int gather_us = 300;
  };
  struct Counters {
    std::uint64_t packets = 0;       ///< from the card
    std::uint64_t bytes = 0;         ///< datagram payload of these, headers included
    std::uint64_t kernel_drops = 0;  ///< dropped by the kernel, as the socket's buffer was full
    std::uint64_t foreign = 0;       ///< from another address than the card's
    std::uint64_t malformed = 0;     ///< too short for a header and a sample, or longer than Ethernet carries
  };

  /// Binds host_ip:port. Accepts only datagrams from card_ip, from any port. Throws RigError, InputError.
  PacketReceiver(const std::string& host_ip, std::uint16_t port, const std::string& card_ip);
  PacketReceiver(const std::string& host_ip, std::uint16_t port, const std::string& card_ip, const Options& options);
  ~PacketReceiver();

  /// Waits up to timeout_ms for data, then visits one batch of what has arrived. Returns the number of packets visited.
  /// The payload is valid only during the visit. Throws RigError where the socket fails.
  int receive(int timeout_ms, const std::function<void(const DataPacket&)>& visit);
  /// Discards what waits in the socket: datagrams of an earlier recording.
  void drain();

  /// `tap` receives every later datagram of the card, unusable ones included, except those that drain() discards.
  void setTap(DatagramTap tap) { tap_ = std::move(tap); }

  const Counters& counters() const { return counters_; }
  /// Size that the kernel granted, in bytes as requested (it reserves twice that). Where it is less than requested,
  /// net.core.rmem_max must be raised.
  std::size_t buffer_bytes() const { return granted_bytes_; }

 private:
  struct Batch;
  UdpSocket socket_;
  in_addr card_;
  sockaddr_in local_{};
  DatagramTap tap_;
  std::unique_ptr<Batch> batch_;
  Counters counters_;
  std::size_t granted_bytes_ = 0;
  std::uint32_t overflow_ = 0;
  int gather_us_;
  int timeout_ms_ = -1;  ///< present time-out of the socket
  bool dense_ = false;   ///< the last batch came soon after the previous one
  std::int64_t last_batch_ns_ = 0;
};

}  // namespace mmradartwin
