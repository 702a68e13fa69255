// Preloaded (LD_PRELOAD) it keeps ROS's sockets on this computer: where ROS_IP or ROS_HOSTNAME is a loopback address,
// what is bound to all addresses is bound to that of loopback. roscpp's XML-RPC server knows nothing of ROS_IP: through
// it whoever reaches the computer could shut a node down.

#include <arpa/inet.h>
#include <dlfcn.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdlib>
#include <cstring>
#include <initializer_list>

namespace {

bool onLoopback() {
  for (const char* name : {"ROS_HOSTNAME", "ROS_IP"}) {  // in the order in which ROS looks
    const char* const host = std::getenv(name);
    if (!host || !*host) continue;
    return std::strcmp(host, "localhost") == 0 || std::strncmp(host, "127.", 4) == 0 || std::strcmp(host, "::1") == 0;
  }
  return false;
}

}  // namespace

extern "C" int bind(int fd, const sockaddr* address, socklen_t size) noexcept {
  using Bind = int (*)(int, const sockaddr*, socklen_t);
  static const auto next = reinterpret_cast<Bind>(dlsym(RTLD_NEXT, "bind"));
  if (address && address->sa_family == AF_INET && size >= sizeof(sockaddr_in) && onLoopback()) {
    sockaddr_in own;
    std::memcpy(&own, address, sizeof own);
    if (own.sin_addr.s_addr == htonl(INADDR_ANY)) {
      own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      return next(fd, reinterpret_cast<const sockaddr*>(&own), sizeof own);
    }
  }
  if (address && address->sa_family == AF_INET6 && size >= sizeof(sockaddr_in6) && onLoopback()) {
    sockaddr_in6 own;
    std::memcpy(&own, address, sizeof own);
    if (IN6_IS_ADDR_UNSPECIFIED(&own.sin6_addr)) {
      own.sin6_addr = in6addr_loopback;
      return next(fd, reinterpret_cast<const sockaddr*>(&own), sizeof own);
    }
  }
  return next(fd, address, size);
}
