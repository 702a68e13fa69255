#pragma once

#include <atomic>
#include <cstdint>
#include <fstream>
#include <functional>
#include <mutex>
#include <string>

#include "lvds_source.h"
#include "played_session.h"

namespace mmradartwin {

/// Reads a session's frames one after the other.
class SessionReader {
 public:
  explicit SessionReader(const PlayedSession& session) : session_(session) {}
  /// Bytes of frame `number` of the session. Throws std::runtime_error where the capture has become shorter.
  std::vector<std::uint8_t> read(std::int64_t number);

 private:
  const PlayedSession& session_;
  std::size_t pose_ = 0;
  std::ifstream capture_;
  std::string open_;
};

/// A radar that begins to play a session some time after the card was first armed, once, whether the card records or
/// not.
class SessionFrames : public LvdsSource {
 public:
  using Log = std::function<void(const std::string&)>;
  SessionFrames(const PlayedSession& session, double start_delay_s, Log log);

  void armed() override;
  bool next(LvdsFrame& frame) override;
  bool over() const override { return next_ == session_.frames; }
  int lanes() const override { return session_.radar.layout == CaptureLayout::kTwoLane ? 2 : 4; }

 private:
  PlayedSession session_;
  SessionReader reader_;
  double start_delay_s_;
  Log log_;
  std::int64_t chirp_ns_, sampled_ns_;
  std::atomic<std::int64_t> start_ns_{0};  ///< of the first frame; 0 before the first RECORD_START
  std::atomic<std::int64_t> next_{0};
};

/// Now, of CLOCK_MONOTONIC or CLOCK_REALTIME.
std::int64_t clock_ns(clockid_t clock);
/// Sleeps until then, but `longest_ns` at most. True where it is then.
bool sleepTowards(std::int64_t monotonic_ns, std::int64_t longest_ns = 20'000'000);

}  // namespace mmradartwin
