#include "emulated_card.h"

#include <arpa/inet.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "session_frames.h"

namespace mmradartwin {
namespace {

// The card's fixed cost per packet; delay + 11.2 us fits table 19 of SPRUIJ4A.
constexpr std::int64_t kPacketCost_ns = 11200;
constexpr std::int64_t kTick_ns = 8;
constexpr std::uint16_t kRecordCompletedBit = 0x0100;

sockaddr_in endpoint(const std::string& ip, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  if (inet_aton(ip.c_str(), &address.sin_addr) == 0) throw std::runtime_error("\"" + ip + "\" is no IPv4 address");
  return address;
}

int boundSocket(const std::string& ip, std::uint16_t port) {
  const sockaddr_in address = endpoint(ip, port);
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0 || bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const std::string why = std::strerror(errno);
    if (fd >= 0) close(fd);
    throw std::runtime_error("the emulated card cannot be " + ip + ":" + std::to_string(port) + ": " + why +
                             " (is another emulator running, and is the address on this host?)");
  }
  return fd;
}

}  // namespace

EmulatedCard::EmulatedCard(LvdsSource& radar, const Options& options, Log log)
    : radar_(radar), options_(options), log_(std::move(log)), random_(options.seed) {
  interval_ns_ = 25000 + kPacketCost_ns;
  host_data_ = endpoint(options_.host_ip, options_.data_port);
  host_config_ = endpoint(options_.host_ip, options_.config_port);
  command_fd_ = boundSocket(options_.card_ip, options_.config_port);
  try {
    card_fd_ = boundSocket(options_.card_ip, options_.source_port);
  } catch (...) {
    close(command_fd_);
    throw;
  }
  const int buffer = 4 << 20;
  setsockopt(card_fd_, SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer);
  radar_.connected();
  thread_ = std::thread([this] { lvdsThread(); });
}

EmulatedCard::~EmulatedCard() {
  stop_ = true;
  thread_.join();
  close(command_fd_);
  close(card_fd_);
}

void EmulatedCard::serve(int timeout_ms) {
  pollfd waiting{command_fd_, POLLIN, 0};
  if (poll(&waiting, 1, timeout_ms) <= 0) return;
  std::vector<std::uint8_t> request(600);
  sockaddr_in from{};
  socklen_t from_size = sizeof from;
  const auto size =
      recvfrom(command_fd_, request.data(), request.size(), 0, reinterpret_cast<sockaddr*>(&from), &from_size);
  if (size < 0 || clock_ns(CLOCK_MONOTONIC) < deaf_until_ns_) return;
  request.resize(static_cast<std::size_t>(size));
  execute(request, from);
}

void EmulatedCard::answer(std::uint16_t code, std::uint16_t status, const sockaddr_in& to) {
  const std::uint8_t bytes[8] = {0x5a,
                                 0xa5,
                                 static_cast<std::uint8_t>(code),
                                 static_cast<std::uint8_t>(code >> 8),
                                 static_cast<std::uint8_t>(status),
                                 static_cast<std::uint8_t>(status >> 8),
                                 0xaa,
                                 0xee};
  sendto(card_fd_, bytes, sizeof bytes, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

void EmulatedCard::execute(const std::vector<std::uint8_t>& request, const sockaddr_in& from) {
  if (request.size() < 8 || request[0] != 0x5a || request[1] != 0xa5) return;
  const int code = request[2] + 256 * request[3];
  const std::size_t body = request[4] + 256u * request[5];
  if (request.size() != 8 + body || request[6 + body] != 0xaa || request[7 + body] != 0xee) return;
  std::uint16_t result = 0;
  switch (code) {
    case 0x01:    // RESET_FPGA
    case 0x06: {  // RECORD_STOP
      const std::lock_guard<std::mutex> lock(mutex_);
      recording_on_ = false;
      break;
    }
    case 0x02:  // RESET_AR_DEV
    case 0x09:  // SYSTEM_CONNECT
      break;
    case 0x03:  // CONFIG_FPGA_GEN: raw mode, 4 or 2 lanes, capture, Ethernet, 16 bit
      result = body == 6 && request[6] == 1 && (request[7] == 1 || request[7] == 2) && request[8] == 1 &&
                       request[9] == 2 && request[10] == 3
                   ? 0
                   : 1;
      if (result == 0) {
        if (radar_.lanes() != (request[7] == 2 ? 2 : 4)) log_("warning: configured for other lanes than the radar's");
        deaf_until_ns_ = clock_ns(CLOCK_MONOTONIC) + std::llround(options_.deaf_s * 1e9);
      }
      break;
    case 0x0b:  // CONFIG_PACKET_DATA: size, delay in ticks. The size changes nothing, as on the cards seen.
      result = body == 6 ? 0 : 1;
      if (result == 0) {
        const std::lock_guard<std::mutex> lock(mutex_);
        interval_ns_ = (request[8] + 256 * request[9]) * kTick_ns + kPacketCost_ns;
      }
      break;
    case 0x0e:
      result = options_.fpga_version;
      break;
    case 0x05:
      answer(0x05, 0, from);
      startRecord();
      return;
    default:
      result = 1;
  }
  answer(static_cast<std::uint16_t>(code), result, from);
}

void EmulatedCard::startRecord() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++recording_;
    recording_on_ = true;
  }
  radar_.armed();
}

/// False where the emulator ends or the recording that was being sent has been stopped.
bool EmulatedCard::sleepUntil(std::int64_t monotonic_ns) {
  while (!stop_) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (sending_ != 0 && (!recording_on_ || recording_ != sending_)) return false;
    }
    if (sleepTowards(monotonic_ns)) return true;
  }
  return false;
}

void EmulatedCard::lvdsThread() {
  prctl(PR_SET_TIMERSLACK, 1UL);  // sleep to the microsecond
  // The card is hardware: it does not wait for this host's other work. Without the right to that it does.
  const sched_param priority{1};
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
  const std::int64_t flush_ns = std::llround(options_.flush_s * 1e9);
  std::int64_t last_sample_ns = 0;
  LvdsFrame frame;
  while (!stop_) {
    if (radar_.next(frame)) {
      takeFrame(frame);
      last_sample_ns = frame.start_ns + (frame.chirps - 1) * frame.chirp_ns + frame.sampled_ns;
      continue;
    }
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!recording_on_ || sending_ != recording_) sending_ = 0;
    }
    const bool idle = clock_ns(CLOCK_MONOTONIC) >= last_sample_ns + flush_ns;
    if (sending_ != 0 && idle) completeRecord();
    if (!radar_.over() || (sending_ != 0 && !idle)) continue;
    log_("completed packets=" + std::to_string(sent_.packets) + " bytes=" + std::to_string(bytes_sent_) +
         " lost=" + std::to_string(sent_.lost) + " duplicated=" + std::to_string(sent_.duplicated) +
         " reordered=" + std::to_string(sent_.reordered) + " truncated=" + std::to_string(sent_.truncated) +
         " own_late_us=" + std::to_string(own_late_ns_ / 1000));
    completed_ = true;
    return;
  }
}

void EmulatedCard::completeRecord() {
  if (!held_.empty()) sendData(held_.size());
  while (!delayed_.empty()) {
    transmit(delayed_.front().datagram);
    delayed_.pop_front();
  }
  status(kRecordCompletedBit);
  sending_ = 0;
  const std::lock_guard<std::mutex> lock(mutex_);
  recording_on_ = false;
}

/// A recording that was started by the time a frame begins takes it from its first byte.
void EmulatedCard::takeFrame(const LvdsFrame& frame) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!recording_on_) {
      sending_ = 0;
      return;
    }
    if (sending_ != recording_) {
      sending_ = recording_;
      sequence_ = 0;
      bytes_sent_ = 0;
      held_.clear();
      delayed_.clear();
    }
  }
  const auto planned = options_.status_at_frame.find(frame.number);
  if (planned != options_.status_at_frame.end()) status(planned->second);
  if (options_.restart_at_frame.count(frame.number)) {
    log_("the counts begin anew with frame " + std::to_string(frame.number));
    sequence_ = 0;
    bytes_sent_ = 0;
    held_.clear();
  }
  const auto silence = options_.silence_at_frame.find(frame.number);
  if (silence != options_.silence_at_frame.end()) silent_until_frame_ = frame.number + silence->second;
  silent_ = frame.number < silent_until_frame_;
  const std::size_t chirp_bytes = frame.bytes.size() / static_cast<std::size_t>(frame.chirps);
  for (int chirp = 0; chirp < frame.chirps && sending_ != 0; ++chirp) {
    const auto begin = frame.bytes.begin() + static_cast<std::ptrdiff_t>(chirp * chirp_bytes);
    held_.insert(held_.end(), begin, begin + static_cast<std::ptrdiff_t>(chirp_bytes));
    sendFull(frame.start_ns + chirp * frame.chirp_ns + frame.sampled_ns);
  }
}

void EmulatedCard::sendFull(std::int64_t available_ns) {
  const auto payload = static_cast<std::size_t>(options_.payload_bytes);
  while (held_.size() >= payload) {
    std::int64_t interval_ns;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      interval_ns = interval_ns_;
    }
    // By the schedule, not by when the last one really went out: this host's delays must not add up.
    last_sent_ns_ = std::max(available_ns, last_sent_ns_ + interval_ns);
    const std::int64_t leaves_ns = last_sent_ns_ + noise_ns();
    if (!sleepUntil(leaves_ns)) {
      sending_ = 0;
      return;
    }
    own_late_ns_ = std::max(own_late_ns_, clock_ns(CLOCK_MONOTONIC) - leaves_ns);
    sendData(payload);
  }
}

std::int64_t EmulatedCard::noise_ns() {
  if (options_.jitter_us <= 0) return 0;
  double late_us = std::exponential_distribution<double>(1 / options_.jitter_us)(random_);
  std::uniform_real_distribution<double> chance(0, 1);
  if (chance(random_) < 0.05) late_us += options_.stall_us * chance(random_);
  return std::llround(late_us * 1e3);
}

/// Sequence number (u32, from 1), bytes sent before (u48, from 0), samples.
void EmulatedCard::sendData(std::size_t bytes) {
  ++sequence_;
  std::vector<std::uint8_t> datagram;
  datagram.reserve(10 + bytes);
  for (int shift = 0; shift < 32; shift += 8) datagram.push_back(static_cast<std::uint8_t>(sequence_ >> shift));
  for (int shift = 0; shift < 48; shift += 8) datagram.push_back(static_cast<std::uint8_t>(bytes_sent_ >> shift));
  const auto end = held_.begin() + static_cast<std::ptrdiff_t>(bytes);
  datagram.insert(datagram.end(), held_.begin(), end);
  held_.erase(held_.begin(), end);
  bytes_sent_ += bytes;
  ++sent_.packets;
  if (silent_) {
    ++sent_.lost;
    return;
  }
  impair(std::move(datagram));
}

void EmulatedCard::impair(std::vector<std::uint8_t> datagram) {
  const auto chance = [this](double probability) {
    return probability > 0 && std::uniform_real_distribution<double>()(random_) < probability;
  };
  if (chance(options_.loss)) {
    ++sent_.lost;
  } else if (chance(options_.reorder)) {
    ++sent_.reordered;
    const int overtakers = std::uniform_int_distribution<int>(1, std::max(1, options_.reorder_depth))(random_);
    delayed_.push_back({std::move(datagram), overtakers});
    return;
  } else {
    if (datagram.size() > 11 && chance(options_.truncate)) {
      ++sent_.truncated;
      datagram.resize(std::uniform_int_distribution<std::size_t>(11, datagram.size() - 1)(random_));
    }
    transmit(datagram);
    if (chance(options_.duplicate)) {
      ++sent_.duplicated;
      transmit(datagram);
    }
  }
  for (Delayed& waiting : delayed_) --waiting.overtakers;
  while (!delayed_.empty() && delayed_.front().overtakers <= 0) {
    transmit(delayed_.front().datagram);
    delayed_.pop_front();
  }
}

void EmulatedCard::transmit(const std::vector<std::uint8_t>& datagram) {
  sendto(card_fd_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&host_data_),
         sizeof host_data_);
}

void EmulatedCard::status(std::uint16_t bits) { answer(0x0a, bits, host_config_); }

}  // namespace mmradartwin
