#include "mmradartwin_driver/dca1000_control.h"

#include <sys/socket.h>
#include <time.h>

#include <cerrno>
#include <cstring>
#include <thread>

#include "mmradartwin_driver/rig_error.h"

namespace mmradartwin {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostStatuses = 64;
/// Datagrams that are looked at after a deadline: whoever sends without end holds nobody up.
constexpr int kMostWaiting = 1000;

std::int64_t now_ns() {
  timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

}  // namespace

Dca1000Control::Dca1000Control(const std::string& host_ip, const std::string& card_ip, std::uint16_t port)
    : Dca1000Control(host_ip, card_ip, port, Options()) {}

Dca1000Control::Dca1000Control(const std::string& host_ip, const std::string& card_ip, std::uint16_t port,
                               const Options& options)
    : options_(options), card_ip_(card_ip), socket_(host_ip, port, "commands") {
  card_.sin_family = AF_INET;
  card_.sin_port = htons(port);
  card_.sin_addr = parseIpv4(card_ip);
  local_ = card_;
  local_.sin_addr = parseIpv4(host_ip);
}

void Dca1000Control::send(Dca1000Command command, const std::vector<std::uint8_t>& body) {
  const std::vector<std::uint8_t> bytes = encodeCommand(command, body);
  if (tap_) tap_({local_, card_, bytes.data(), bytes.size(), now_ns()});
  const auto sent =
      sendto(socket_.fd(), bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&card_), sizeof card_);
  if (sent == static_cast<ssize_t>(bytes.size())) return;
  // A closed port is reported with the next datagram: that is silence of the card, not a failure of this host.
  if (errno == ECONNREFUSED) return;
  throw RigError("cannot send to the card at " + card_ip_ + " (" + std::strerror(errno) +
                 "): check that the cable is plugged in and that this host's address is in the card's network");
}

std::optional<Dca1000Reply> Dca1000Control::receive(Clock::time_point deadline) {
  for (int late = 0; late < kMostWaiting;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (!socket_.waitReadable(left > 0 ? static_cast<int>(left) : 0)) return std::nullopt;
    late += left <= 0;
    std::uint8_t bytes[64];
    sockaddr_in from{};
    socklen_t from_size = sizeof from;
    const auto size =
        recvfrom(socket_.fd(), bytes, sizeof bytes, MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from), &from_size);
    if (size < 0 || from.sin_addr.s_addr != card_.sin_addr.s_addr)
      continue;  // the reply comes from port 1024, not from the command port
    if (tap_) tap_({from, local_, bytes, static_cast<std::size_t>(size), now_ns()});
    if (const auto reply = decodeReply(bytes, static_cast<std::size_t>(size))) return reply;
  }
  return std::nullopt;
}

void Dca1000Control::keep(std::uint16_t status) {
  if (statuses_.size() == kMostStatuses) statuses_.pop_front();
  statuses_.push_back(status);
}

void Dca1000Control::forgetStatuses() {
  const auto now = Clock::now();
  for (int i = 0; i < kMostWaiting && receive(now); ++i) {
  }
  statuses_.clear();
}

Dca1000Reply Dca1000Control::command(Dca1000Command command, const std::vector<std::uint8_t>& body, int attempts) {
  for (int attempt = 0; attempt < attempts; ++attempt) {
    send(command, body);
    const auto deadline = Clock::now() + options_.reply_timeout;
    while (const auto reply = receive(deadline)) {
      if (reply->code == static_cast<std::uint16_t>(command)) return *reply;
      if (reply->code == static_cast<std::uint16_t>(Dca1000Command::kSystemStatus)) keep(reply->status);
      // Any other reply is a late answer to an earlier attempt.
    }
  }
  throw RigError(
      "no answer from the DCA1000 at " + card_ip_ + " to " + commandName(static_cast<std::uint16_t>(command)) +
      ": check its power, the cable, that SW2.5 is on SW_CONFIG, and that no firewall blocks UDP from the card");
}

void Dca1000Control::done(Dca1000Command code, const std::vector<std::uint8_t>& body) {
  const Dca1000Reply reply = command(code, body, options_.attempts);
  if (reply.status == 0) return;
  throw RigError("the DCA1000 at " + card_ip_ + " refuses " + commandName(reply.code) + " (status " +
                 std::to_string(reply.status) +
                 "): check SW2.5 (SW_CONFIG) and the LVDS ribbon to the radar, then power the card off and on");
}

void Dca1000Control::connect() { done(Dca1000Command::kSystemConnect); }

bool Dca1000Control::answers() {
  try {
    return command(Dca1000Command::kSystemConnect, {}, 1).status == 0;
  } catch (const RigError&) {
    return false;
  }
}

void Dca1000Control::resetFpga() { done(Dca1000Command::kResetFpga); }
void Dca1000Control::resetRadar() { done(Dca1000Command::kResetRadar); }

FpgaVersion Dca1000Control::readVersion() {
  return decodeFpgaVersion(command(Dca1000Command::kReadFpgaVersion, {}, options_.attempts).status);
}

void Dca1000Control::configureFpga(int lanes) {
  done(Dca1000Command::kConfigFpga, fpgaConfigBody(lanes));
  const auto limit = Clock::now() + options_.deaf_limit;
  while (!answers()) {
    if (Clock::now() > limit) {
      throw RigError("the DCA1000 at " + card_ip_ + " has not answered since it was configured: power it off and on");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

void Dca1000Control::configurePackets(double delay_us, std::uint16_t packet_bytes) {
  done(Dca1000Command::kConfigPacketData, packetConfigBody(packet_bytes, packetDelayTicks(delay_us)));
}

void Dca1000Control::startRecord() { done(Dca1000Command::kRecordStart); }
void Dca1000Control::stopRecord() { done(Dca1000Command::kRecordStop); }

std::optional<std::uint16_t> Dca1000Control::takeStatus(std::chrono::milliseconds wait) {
  const auto deadline = Clock::now() + wait;
  while (statuses_.empty()) {
    const auto reply = receive(deadline);
    if (!reply) return std::nullopt;
    if (reply->code == static_cast<std::uint16_t>(Dca1000Command::kSystemStatus)) keep(reply->status);
  }
  const std::uint16_t status = statuses_.front();
  statuses_.pop_front();
  return status;
}

}  // namespace mmradartwin
