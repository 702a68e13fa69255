#include "mmradartwin_driver/frame_clock.h"

#include <algorithm>
#include <cmath>

namespace mmradartwin {

FrameClock::FrameClock(const RadarConfig& radar, double drift)
    : frame_bytes_(radar.bytes_per_frame()),
      chirp_bytes_(radar.bytes_per_frame() / radar.chirps_per_frame()),
      period_ns_(radar.frame_period_s * 1e9),
      drift_(drift) {
  const bool timed = std::isfinite(radar.idle_s) && std::isfinite(radar.ramp_end_s);
  const double idle_s = timed ? radar.idle_s : 0.0;
  const double sampled_s = radar.adc_start_s + radar.samples_per_chirp / radar.sample_rate_hz;
  chirp_ns_ = (timed ? idle_s + radar.ramp_end_s : sampled_s) * 1e9;
  sampled_ns_ = (idle_s + sampled_s) * 1e9;
}

std::int64_t FrameClock::startFromPacket(std::uint64_t frame, std::uint64_t last_byte, std::int64_t stamp_ns) const {
  const std::uint64_t last_frame = last_byte / frame_bytes_;
  const std::uint64_t chirp = last_byte % frame_bytes_ / chirp_bytes_;
  const double frames = static_cast<double>(last_frame) - static_cast<double>(frame);
  return stamp_ns - std::llround(frames * period_ns_ + static_cast<double>(chirp) * chirp_ns_ + sampled_ns_);
}

std::int64_t FrameClock::observe(std::uint64_t frame, std::int64_t start_ns) {
  if (known_) {
    const double elapsed_ns = static_cast<double>(frame - frame_) * period_ns_;
    const std::int64_t latest_ns = start_ns_ + std::llround(elapsed_ns * (1 + drift_));
    if (start_ns - latest_ns < std::llround(period_ns_ / 2)) start_ns = std::min(start_ns, latest_ns);
  }
  known_ = true;
  frame_ = frame;
  start_ns_ = start_ns;
  return start_ns;
}

std::optional<std::int64_t> FrameClock::predict(std::uint64_t frame) const {
  if (!known_) return std::nullopt;
  return start_ns_ + std::llround((static_cast<double>(frame) - static_cast<double>(frame_)) * period_ns_);
}

void FrameClock::reset() { known_ = false; }

}  // namespace mmradartwin
