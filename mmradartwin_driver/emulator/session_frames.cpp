#include "session_frames.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mmradartwin {

std::int64_t clock_ns(clockid_t clock) {
  timespec now;
  clock_gettime(clock, &now);
  return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

bool sleepTowards(std::int64_t monotonic_ns, std::int64_t longest_ns) {
  const std::int64_t now = clock_ns(CLOCK_MONOTONIC);
  if (now >= monotonic_ns) return true;
  const std::int64_t until = std::min(monotonic_ns, now + longest_ns);
  const timespec at{until / 1'000'000'000, until % 1'000'000'000};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr);
  return clock_ns(CLOCK_MONOTONIC) >= monotonic_ns;
}

std::vector<std::uint8_t> SessionReader::read(std::int64_t number) {
  const auto holds = [&](const PlayedPose& pose) {
    return number >= pose.first_frame && number < pose.first_frame + pose.frames;
  };
  if (!holds(session_.poses.at(pose_))) {
    const auto found = std::find_if(session_.poses.begin(), session_.poses.end(), holds);
    if (found == session_.poses.end()) throw std::runtime_error("the session has no frame " + std::to_string(number));
    pose_ = static_cast<std::size_t>(found - session_.poses.begin());
  }
  const PlayedPose& pose = session_.poses[pose_];
  if (open_ != pose.capture) {
    capture_ = std::ifstream(pose.capture, std::ios::binary);
    open_ = pose.capture;
  }
  std::vector<std::uint8_t> bytes(session_.radar.bytes_per_frame());
  capture_.clear();
  capture_.seekg(static_cast<std::streamoff>(bytes.size()) * (number - pose.first_frame));
  capture_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!capture_) throw std::runtime_error(pose.capture + " has become shorter while it was played");
  return bytes;
}

SessionFrames::SessionFrames(const PlayedSession& session, double start_delay_s, Log log)
    : session_(session), reader_(session_), start_delay_s_(start_delay_s), log_(std::move(log)) {
  const RadarConfig& radar = session_.radar;
  const bool timed = std::isfinite(radar.idle_s) && std::isfinite(radar.ramp_end_s);
  const double idle_s = timed ? radar.idle_s : 0;
  const double sampled_s = idle_s + radar.adc_start_s + radar.samples_per_chirp / radar.sample_rate_hz;
  sampled_ns_ = std::llround(sampled_s * 1e9);
  chirp_ns_ = timed ? std::llround((radar.idle_s + radar.ramp_end_s) * 1e9) : sampled_ns_;
}

void SessionFrames::armed() {
  const bool first = start_ns_ == 0;
  if (first) start_ns_ = clock_ns(CLOCK_MONOTONIC) + std::llround(start_delay_s_ * 1e9);
  const std::int64_t first_frame_ns = start_ns_ + clock_ns(CLOCK_REALTIME) - clock_ns(CLOCK_MONOTONIC);
  log_((first ? "armed first_frame_ns=" : "armed again, playing since first_frame_ns=") +
       std::to_string(first_frame_ns) + " frames=" + std::to_string(session_.frames));
}

bool SessionFrames::next(LvdsFrame& frame) {
  if (start_ns_ == 0 || over()) {
    sleepTowards(clock_ns(CLOCK_MONOTONIC) + 5'000'000);
    return false;
  }
  const std::int64_t start_ns =
      start_ns_ + std::llround(static_cast<double>(next_) * session_.radar.frame_period_s * 1e9);
  if (!sleepTowards(start_ns)) return false;
  frame.start_ns = start_ns;
  frame.number = next_++;
  frame.chirps = session_.radar.chirps_per_frame();
  frame.chirp_ns = chirp_ns_;
  frame.sampled_ns = sampled_ns_;
  try {
    frame.bytes = reader_.read(frame.number);
  } catch (const std::runtime_error& error) {
    log_(std::string("warning: ") + error.what());
    frame.bytes.assign(session_.radar.bytes_per_frame(), 0);
  }
  return true;
}

}  // namespace mmradartwin
