#include "mmradartwin_driver/packet_receiver.h"

#include <sys/socket.h>
#include <time.h>

#include <cerrno>
#include <cstring>

#include "mmradartwin_driver/rig_error.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kLongestDatagram = 2048;  // the card's have at most 1472 bytes, Ethernet's limit

std::size_t forceReceiveBuffer(int fd, std::size_t bytes) {
  const int wanted = static_cast<int>(bytes);
  // SO_RCVBUFFORCE exceeds net.core.rmem_max but needs CAP_NET_ADMIN.
  if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &wanted, sizeof wanted) != 0) {
    setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &wanted, sizeof wanted);
  }
  int granted = 0;
  socklen_t size = sizeof granted;
  getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &granted, &size);
  return static_cast<std::size_t>(granted) / 2;
}

std::int64_t wallClock_ns() {
  timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

}  // namespace

struct PacketReceiver::Batch {
  // Two control messages: the receive time and the overflow count.
  static constexpr std::size_t kControlBytes = CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t));

  explicit Batch(int size)
      : data(size * kLongestDatagram), control(size * kControlBytes), sources(size), vectors(size), messages(size) {
    for (int i = 0; i < size; ++i) {
      vectors[i] = {&data[i * kLongestDatagram], kLongestDatagram};
      msghdr& header = messages[i].msg_hdr;
      header = {};
      header.msg_name = &sources[i];
      header.msg_iov = &vectors[i];
      header.msg_iovlen = 1;
      header.msg_control = &control[i * kControlBytes];
    }
  }
  void prepare(int count) {
    for (int i = 0; i < count; ++i) {
      messages[i].msg_hdr.msg_namelen = sizeof(sockaddr_in);
      messages[i].msg_hdr.msg_controllen = kControlBytes;
      messages[i].msg_hdr.msg_flags = 0;
    }
  }

  std::vector<std::uint8_t> data, control;
  std::vector<sockaddr_in> sources;
  std::vector<iovec> vectors;
  std::vector<mmsghdr> messages;
};

PacketReceiver::PacketReceiver(const std::string& host_ip, std::uint16_t port, const std::string& card_ip)
    : PacketReceiver(host_ip, port, card_ip, Options()) {}

PacketReceiver::PacketReceiver(const std::string& host_ip, std::uint16_t port, const std::string& card_ip,
                               const Options& options)
    : socket_(host_ip, port, "samples"),
      card_(parseIpv4(card_ip)),
      batch_(std::make_unique<Batch>(options.batch)),
      gather_us_(options.gather_us) {
  local_.sin_family = AF_INET;
  local_.sin_port = htons(port);
  local_.sin_addr = parseIpv4(host_ip);
  granted_bytes_ = forceReceiveBuffer(socket_.fd(), options.buffer_bytes);
  const int on = 1;
  if (setsockopt(socket_.fd(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) != 0 ||
      setsockopt(socket_.fd(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) != 0) {
    throw RigError(std::string("the kernel gives no receive times or drop counts: ") + std::strerror(errno));
  }
}

PacketReceiver::~PacketReceiver() = default;

int PacketReceiver::receive(int timeout_ms, const std::function<void(const DataPacket&)>& visit) {
  const int size = static_cast<int>(batch_->messages.size());
  batch_->prepare(size);
  if (timeout_ms > 0 && timeout_ms != timeout_ms_) {
    const timeval wait{timeout_ms / 1000, timeout_ms % 1000 * 1000};
    setsockopt(socket_.fd(), SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
    timeout_ms_ = timeout_ms;
  }
  if (dense_ && timeout_ms > 0) {
    const timespec gather{0, gather_us_ * 1000L};
    clock_nanosleep(CLOCK_MONOTONIC, 0, &gather, nullptr);
  }
  // Waits for the first datagram only, in one call into the kernel.
  const int got =
      recvmmsg(socket_.fd(), batch_->messages.data(), size, timeout_ms > 0 ? MSG_WAITFORONE : MSG_DONTWAIT, nullptr);
  if (got < 0) {
    dense_ = false;
    if (errno == EAGAIN || errno == EINTR) return 0;
    throw RigError(std::string("the data socket fails: ") + std::strerror(errno));
  }
  constexpr std::int64_t kDense_ns = 2'000'000;
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  const std::int64_t batch_ns = now.tv_sec * 1'000'000'000LL + now.tv_nsec;
  dense_ = gather_us_ > 0 && got < size && batch_ns - last_batch_ns_ < kDense_ns;  // after a full batch more may wait
  last_batch_ns_ = batch_ns;
  int visited = 0;
  for (int i = 0; i < got; ++i) {
    msghdr& header = batch_->messages[i].msg_hdr;
    std::int64_t stamp_ns = 0;
    for (cmsghdr* c = CMSG_FIRSTHDR(&header); c; c = CMSG_NXTHDR(&header, c)) {
      if (c->cmsg_level != SOL_SOCKET) continue;
      if (c->cmsg_type == SCM_TIMESTAMPNS) {
        timespec at;
        std::memcpy(&at, CMSG_DATA(c), sizeof at);
        stamp_ns = at.tv_sec * 1'000'000'000LL + at.tv_nsec;
      } else if (c->cmsg_type == SO_RXQ_OVFL) {
        std::uint32_t count;  // of this socket since it was opened, modulo 2^32
        std::memcpy(&count, CMSG_DATA(c), sizeof count);
        counters_.kernel_drops += static_cast<std::uint32_t>(count - overflow_);
        overflow_ = count;
      }
    }
    if (stamp_ns == 0) stamp_ns = wallClock_ns();
    if (batch_->sources[i].sin_addr.s_addr != card_.s_addr) {
      ++counters_.foreign;
      continue;
    }
    if (tap_) {
      tap_({batch_->sources[i], local_, static_cast<const std::uint8_t*>(batch_->vectors[i].iov_base),
            batch_->messages[i].msg_len, stamp_ns});
    }
    const auto packet = decodeDataPacket(static_cast<const std::uint8_t*>(batch_->vectors[i].iov_base),
                                         batch_->messages[i].msg_len, stamp_ns);
    if (!packet || (header.msg_flags & MSG_TRUNC)) {
      ++counters_.malformed;
      continue;
    }
    ++counters_.packets;
    counters_.bytes += batch_->messages[i].msg_len;
    ++visited;
    visit(*packet);
  }
  return visited;
}

void PacketReceiver::drain() {
  const Counters before = counters_;
  DatagramTap tap;
  tap.swap(tap_);
  while (socket_.waitReadable(0)) receive(0, [](const DataPacket&) {});
  tap.swap(tap_);
  counters_ = before;
}

}  // namespace mmradartwin
