#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <string>

namespace mmradartwin {

/// Bound IPv4 datagram socket that closes itself. It is never connected, as the card answers from another port than it
/// listens on.
class UdpSocket {
 public:
  /// Binds host_ip:port. purpose: named in errors ("samples", "commands"). Throws RigError (address not of this host,
  /// port in use, no permission), InputError (invalid address).
  UdpSocket(const std::string& host_ip, std::uint16_t port, const std::string& purpose);
  ~UdpSocket();
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  int fd() const { return fd_; }
  /// Waits until a datagram can be read; false after timeout_ms.
  bool waitReadable(int timeout_ms) const;

 private:
  int fd_ = -1;
};

/// IPv4 address of a text. Throws InputError where `ip` is no dotted IPv4 address.
in_addr parseIpv4(const std::string& ip);

}  // namespace mmradartwin
