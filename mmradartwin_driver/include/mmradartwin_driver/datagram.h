#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <functional>

namespace mmradartwin {

/// Datagram between card and host, as it was on the wire.
struct Datagram {
  sockaddr_in source{}, destination{};
  const std::uint8_t* bytes = nullptr;  ///< not owned
  std::size_t size = 0;
  std::int64_t stamp_ns = 0;
};
/// Receives datagrams as they pass, before they are decoded.
using DatagramTap = std::function<void(const Datagram&)>;

}  // namespace mmradartwin
