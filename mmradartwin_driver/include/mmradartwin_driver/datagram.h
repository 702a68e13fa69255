#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <functional>

namespace mmradartwin {

/// A datagram between card and host, as it went over the wire.
struct Datagram {
  sockaddr_in source{}, destination{};
  const std::uint8_t* bytes = nullptr;  ///< not owned
  std::size_t size = 0;
  std::int64_t stamp_ns = 0;
};
/// Sees datagrams as they pass, before anything is made of them.
using DatagramTap = std::function<void(const Datagram&)>;

}  // namespace mmradartwin
