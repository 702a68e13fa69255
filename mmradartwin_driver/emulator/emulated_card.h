#pragma once

#include <netinet/in.h>

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "lvds_source.h"

namespace mmradartwin {

/// A DCA1000EVM as seen from the Ethernet port; its radar is an LvdsSource. Written from the protocol document, apart
/// from the driver: what the one gets wrong the other does not repeat.
///
/// Time: a chirp's bytes are with the card when its last sample has been taken. The card sends whenever a payload is
/// full, packets at least delay + 11.2 us apart, and what is left 2 s after the last chirp, with the record-completed
/// status.
class EmulatedCard {
 public:
  struct Options {
    std::string card_ip = "192.168.33.180", host_ip = "192.168.33.30";
    std::uint16_t config_port = 4096, data_port = 4098, source_port = 1024;
    int payload_bytes = 1456;
    double flush_s = 2.0;
    double deaf_s = 0.3;                  ///< after CONFIG_FPGA
    std::uint16_t fpga_version = 0x0402;  ///< as READ_FPGA_VERSION answers: bits 0-6 major, 7-13 minor, 14 playback
    std::uint64_t seed = 1;
    double loss = 0, duplicate = 0, reorder = 0, truncate = 0;  ///< probability per data packet
    int reorder_depth = 2;                                      ///< so many packets overtake a reordered one, at most
    std::map<std::int64_t, std::uint16_t> status_at_frame;      ///< unsolicited status bits
    /// Both counts begin anew with these frames, as after a moment without power; what waits for a full packet is gone.
    std::set<std::int64_t> restart_at_frame;
    std::map<std::int64_t, std::int64_t> silence_at_frame;  ///< nothing leaves for so many frames; the counts go on
    /// Scheduling noise: each packet leaves later than the card would send it, by an exponential time of this mean, and
    /// one in twenty by up to `stall_us` more.
    double jitter_us = 0, stall_us = 0;
  };
  /// Lines about what happens. From both threads.
  using Log = std::function<void(const std::string&)>;

  EmulatedCard(LvdsSource& radar, const Options& options, Log log);  ///< Throws std::runtime_error.
  ~EmulatedCard();

  /// Serves commands for up to timeout_ms.
  void serve(int timeout_ms);
  /// The radar's frames are over and the recording completed.
  bool completed() const { return completed_; }

 private:
  struct Sent {
    std::uint64_t packets = 0, lost = 0, duplicated = 0, reordered = 0, truncated = 0;
  };
  void answer(std::uint16_t code, std::uint16_t status, const sockaddr_in& to);
  void execute(const std::vector<std::uint8_t>& request, const sockaddr_in& from);
  void startRecord();
  void lvdsThread();
  void takeFrame(const LvdsFrame& frame);
  void completeRecord();
  void sendFull(std::int64_t available_ns);
  void sendData(std::size_t bytes);
  std::int64_t noise_ns();
  void impair(std::vector<std::uint8_t> datagram);
  void transmit(const std::vector<std::uint8_t>& datagram);
  void status(std::uint16_t bits);
  bool sleepUntil(std::int64_t monotonic_ns);

  LvdsSource& radar_;
  Options options_;
  Log log_;
  int command_fd_ = -1, card_fd_ = -1;
  sockaddr_in host_data_{}, host_config_{};
  std::int64_t deaf_until_ns_ = 0;

  std::mutex mutex_;             // the three below
  std::uint64_t recording_ = 0;  ///< counts RECORD_STARTs
  bool recording_on_ = false;
  std::int64_t interval_ns_;  ///< between packets

  // Of the thread that takes what the lanes bring.
  std::uint64_t sending_ = 0;  ///< recording that the counts belong to
  std::uint32_t sequence_ = 0;
  std::uint64_t bytes_sent_ = 0;
  std::vector<std::uint8_t> held_;  ///< bytes waiting for a full payload
  std::int64_t silent_until_frame_ = 0;
  bool silent_ = false;
  std::int64_t last_sent_ns_ = 0;
  std::int64_t own_late_ns_ = 0;  ///< the most that this host, not the noise asked for, made a packet late
  struct Delayed {
    std::vector<std::uint8_t> datagram;
    int overtakers;
  };
  std::deque<Delayed> delayed_;
  std::mt19937_64 random_;
  Sent sent_;

  std::atomic<bool> stop_{false}, completed_{false};
  std::thread thread_;
};

}  // namespace mmradartwin
