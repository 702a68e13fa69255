#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "mmradartwin_driver/datagram.h"

namespace mmradartwin {

/// Records datagrams as a pcap of Ethernet frames with nanosecond stamps, for Wireshark and readPcap(). The headers are
/// made as the card makes them: no UDP checksum, TTL 255, do not fragment; the host's MAC address is 02:00:00:00:00:01.
///
/// A thread of its own writes; whoever adds never waits for the disk. Where the disk is too slow for `queue_bytes`,
/// datagrams are left out and counted. Where less than `min_free_bytes` are left on it, the recording ends with the
/// last whole packet, and problem() says so: the rest is for the bag, the logs and whoever makes room.
class PcapWriter {
 public:
  /// Opens the file. "{stamp}" in the name is replaced by the time, such as 20250131T235959. Throws InputError where
  /// the file exists already or cannot be written.
  explicit PcapWriter(const std::string& file, std::size_t queue_bytes = 256u << 20,
                      std::uint64_t min_free_bytes = 1u << 30);
  ~PcapWriter();  ///< writes all waiting datagrams

  void add(const Datagram& datagram);
  /// Waits until everything added has been written.
  void flush();

  const std::string& file() const { return file_; }
  std::uint64_t written() const { return written_; }
  std::uint64_t left_out() const { return left_out_; }
  /// Problem in one line; empty where there is none.
  std::string problem() const;

 private:
  struct Output;
  void run();
  void write(const std::vector<std::uint8_t>& records);
  bool spaceLeft();
  void end(const std::string& why);

  std::string file_;
  std::size_t queue_bytes_;
  std::uint64_t min_free_bytes_;
  std::unique_ptr<Output> output_;
  std::atomic<std::uint64_t> written_{0}, left_out_{0};

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::uint8_t> waiting_;  ///< stamp, size, frame; one after the other
  std::string problem_;
  bool writing_ = false, stop_ = false;
  std::thread thread_;
};

}  // namespace mmradartwin
