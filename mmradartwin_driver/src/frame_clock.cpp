#include "mmradartwin_driver/frame_clock.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace mmradartwin {
namespace {

constexpr double kLongest_ns = 1e18;  // 30 years: a frame so far away results from a damaged count

}  // namespace

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
  const std::int64_t observed_ns = start_ns;
  if (known_ && static_cast<double>(frame - origin_frame_) * period_ns_ > kLongest_ns) reset();
  if (known_) {
    const double elapsed_ns = static_cast<double>(frame - frame_) * period_ns_;
    const std::int64_t latest_ns = start_ns_ + std::llround(elapsed_ns * (1 + drift_));
    if (start_ns - latest_ns < std::llround(period_ns_ / 2)) {
      start_ns = std::min(start_ns, latest_ns);
    } else {
      observations_.clear();
    }
  }
  if (observations_.empty()) {
    origin_frame_ = frame;
    origin_ns_ = observed_ns;
  }
  const double nominal_ns = static_cast<double>(frame - origin_frame_) * period_ns_;
  observations_.push_back({frame, static_cast<double>(observed_ns - origin_ns_) - nominal_ns});
  if (observations_.size() > kWindow) observations_.pop_front();
  if (const auto late_ns = fittedLate_ns(frame)) {
    start_ns = std::min<std::int64_t>(observed_ns, origin_ns_ + std::llround(nominal_ns + *late_ns));
  }
  known_ = true;
  frame_ = frame;
  start_ns_ = start_ns;
  return start_ns;
}

std::optional<double> FrameClock::fittedLate_ns(std::uint64_t frame) const {
  if (observations_.size() < kEnough) return std::nullopt;
  const std::uint64_t first = observations_.front().frame;
  const auto x = [first](const Observation& o) { return static_cast<double>(o.frame - first); };
  std::vector<const Observation*> hull;
  double mean = 0;
  for (const Observation& next : observations_) {
    mean += x(next);
    while (hull.size() >= 2) {
      const Observation &a = *hull[hull.size() - 2], &b = *hull.back();
      // b is removed where it lies on or above the chord from a to next.
      const double above = (b.late_ns - a.late_ns) * (x(next) - x(a)) - (next.late_ns - a.late_ns) * (x(b) - x(a));
      if (above < 0) break;
      hull.pop_back();
    }
    hull.push_back(&next);
  }
  mean /= static_cast<double>(observations_.size());
  std::size_t right = 1;
  while (right + 1 < hull.size() && x(*hull[right]) < mean) ++right;
  const Observation &a = *hull[right - 1], &b = *hull[right];
  const double limit = drift_ * period_ns_;  // limit of a crystal's error
  const double slope = std::clamp((b.late_ns - a.late_ns) / (x(b) - x(a)), -limit, limit);
  const Observation& rests_on = mean - x(a) < x(b) - mean ? a : b;
  return rests_on.late_ns + slope * (static_cast<double>(frame - first) - x(rests_on));
}

std::optional<std::int64_t> FrameClock::predict(std::uint64_t frame) const {
  if (!known_) return std::nullopt;
  const double elapsed_ns = (static_cast<double>(frame) - static_cast<double>(frame_)) * period_ns_;
  if (std::abs(elapsed_ns) > kLongest_ns) return std::nullopt;
  return start_ns_ + std::llround(elapsed_ns);
}

void FrameClock::reset() {
  known_ = false;
  observations_.clear();
}

}  // namespace mmradartwin
