#include "mmradartwin_driver/udp_socket.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "mmradartwin_driver/rig_error.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

in_addr parseIpv4(const std::string& ip) {
  in_addr address{};
  if (inet_pton(AF_INET, ip.c_str(), &address) != 1) {
    throw InputError("\"" + ip + "\" is no IPv4 address: write it like 192.168.33.30");
  }
  return address;
}

UdpSocket::UdpSocket(const std::string& host_ip, std::uint16_t port, const std::string& purpose) {
  sockaddr_in local{};
  local.sin_family = AF_INET;
  local.sin_port = htons(port);
  local.sin_addr = parseIpv4(host_ip);
  fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd_ < 0) throw RigError("cannot open a UDP socket for " + purpose + ": " + std::strerror(errno));
  if (bind(fd_, reinterpret_cast<sockaddr*>(&local), sizeof local) == 0) return;
  const int error = errno;
  close(fd_);
  fd_ = -1;
  const std::string where = host_ip + ":" + std::to_string(port);
  if (error == EADDRNOTAVAIL) {
    throw RigError("this host has no address " + host_ip +
                   ": give it to the Ethernet port that the card is plugged into (ip addr add " + host_ip +
                   "/24 dev PORT; ip link set PORT up)");
  }
  if (error == EADDRINUSE) {
    throw RigError("UDP port " + where + " for " + purpose +
                   " is in use: stop the other program that talks to the card (ss -ulpn 'sport = :" +
                   std::to_string(port) + "' names it)");
  }
  throw RigError("cannot bind UDP " + where + " for " + purpose + ": " + std::strerror(error));
}

UdpSocket::~UdpSocket() {
  if (fd_ >= 0) close(fd_);
}

bool UdpSocket::waitReadable(int timeout_ms) const {
  pollfd waiting{fd_, POLLIN, 0};
  return poll(&waiting, 1, timeout_ms) > 0;
}

}  // namespace mmradartwin
