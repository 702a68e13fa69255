#pragma once

#include <netinet/in.h>

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "played_session.h"

namespace mmradartwin {

/// A DCA1000EVM with a radar on its LVDS side, as seen from the Ethernet port. Written from the protocol document,
/// apart from the driver: what the one gets wrong the other does not repeat.
///
/// Time: the radar triggers its first frame start_delay_s after the first RECORD_START and then one every frame period,
/// armed or not. Chirp c of a frame is sampled c * (idle + ramp_end) + idle + adc_start + N / f_s after its start, and
/// its bytes are with the card then. The card sends whenever a payload is full, packets at least delay + 11.2 us apart,
/// and what is left 2 s after the last chirp, with the record-completed status.
class EmulatedCard {
 public:
  struct Options {
    std::string card_ip = "192.168.33.180", host_ip = "192.168.33.30";
    std::uint16_t config_port = 4096, data_port = 4098, source_port = 1024;
    int payload_bytes = 1456;
    double start_delay_s = 1.0;
    double flush_s = 2.0;
    double deaf_s = 0.3;  ///< after CONFIG_FPGA
    std::uint64_t seed = 1;
    double loss = 0, duplicate = 0, reorder = 0, truncate = 0;  ///< probability per data packet
    int reorder_depth = 2;                                      ///< so many packets overtake a reordered one, at most
    std::map<std::int64_t, std::uint16_t> status_at_frame;      ///< unsolicited status bits
  };
  /// Lines about what happens, "armed first_frame_ns=... frames=..." among them. From both threads.
  using Log = std::function<void(const std::string&)>;

  EmulatedCard(const PlayedSession& session, const Options& options, Log log);  ///< Throws std::runtime_error.
  ~EmulatedCard();

  /// Serves commands for up to timeout_ms.
  void serve(int timeout_ms);
  /// The last frame was played and the recording completed.
  bool completed() const { return completed_; }

 private:
  struct Sent {
    std::uint64_t packets = 0, lost = 0, duplicated = 0, reordered = 0, truncated = 0;
  };
  void answer(std::uint16_t code, std::uint16_t status, const sockaddr_in& to);
  void execute(const std::vector<std::uint8_t>& request, const sockaddr_in& from);
  void startRecord();
  void radarThread();
  void playFrame(std::int64_t index, const std::vector<std::uint8_t>& bytes);
  void sendFull(std::int64_t available_ns);
  void sendData(std::size_t bytes);
  void impair(std::vector<std::uint8_t> datagram);
  void transmit(const std::vector<std::uint8_t>& datagram);
  void status(std::uint16_t bits);
  std::int64_t frameOffset_ns(std::int64_t frame) const;
  bool sleepUntil(std::int64_t monotonic_ns);

  PlayedSession session_;
  Options options_;
  Log log_;
  int command_fd_ = -1, card_fd_ = -1;
  sockaddr_in host_data_{}, host_config_{};
  std::int64_t deaf_until_ns_ = 0;
  std::int64_t chirp_ns_, sampled_ns_;

  std::mutex mutex_;             // the four below
  std::uint64_t recording_ = 0;  ///< counts RECORD_STARTs
  bool recording_on_ = false;
  std::int64_t radar_start_ns_ = 0;  ///< monotonic; 0 before the first RECORD_START
  std::int64_t interval_ns_;         ///< between packets

  // Of the radar's thread.
  std::uint64_t sending_ = 0;  ///< recording that the counts belong to
  std::uint32_t sequence_ = 0;
  std::uint64_t bytes_sent_ = 0;
  std::vector<std::uint8_t> held_;  ///< bytes waiting for a full payload
  std::int64_t last_sent_ns_ = 0;
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
