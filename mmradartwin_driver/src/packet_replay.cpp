#include "mmradartwin_driver/packet_replay.h"

#include <sys/socket.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <optional>
#include <thread>

#include "mmradartwin_driver/rig_error.h"
#include "mmradartwin_driver/udp_socket.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

std::uint64_t replayPackets(const std::string& file, const PacketReplayOptions& options) {
  using Clock = std::chrono::steady_clock;
  if (!(options.rate > 0) || !std::isfinite(options.rate)) {
    throw InputError("rate " + std::to_string(options.rate) + ": must be above 0");
  }
  demandOneCard(file, readPcap(file, {}, options.recorded), options.recorded, "--recorded-card-ip");
  const UdpSocket socket(options.card_ip, options.source_port, "the replay");
  sockaddr_in host{};
  host.sin_family = AF_INET;
  host.sin_port = htons(options.data_port);
  host.sin_addr = parseIpv4(options.host_ip);
  std::optional<std::int64_t> first_ns;
  const Clock::time_point begin = Clock::now();
  PcapVisitor visitor;
  visitor.data = [&](const DataPacket& packet) {
    if (!first_ns) first_ns = packet.stamp_ns;
    const double due_ns = static_cast<double>(packet.stamp_ns - *first_ns) / options.rate;
    std::this_thread::sleep_until(begin + std::chrono::nanoseconds(std::llround(due_ns)));
    // The packet is a view of the datagram: the header precedes the samples.
    const auto sent = sendto(socket.fd(), packet.payload - kDataHeaderBytes, packet.size + kDataHeaderBytes, 0,
                             reinterpret_cast<const sockaddr*>(&host), sizeof host);
    // A closed port is reported with a later datagram.
    if (sent < 0 && errno != ECONNREFUSED) {
      throw RigError("cannot send to " + options.host_ip + ": " + std::strerror(errno));
    }
  };
  return readPcap(file, visitor, options.recorded).data;
}

}  // namespace mmradartwin
