#include "emulated_lvds.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <complex>
#include <stdexcept>

namespace mmradartwin {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLight_m_per_s = 299792458.0;
constexpr std::int64_t kTriggerDelay_ns = 2'000'000;

void put(std::vector<std::uint8_t>& bytes, std::size_t word, int value) {
  bytes[2 * word] = static_cast<std::uint8_t>(value & 0xFF);
  bytes[2 * word + 1] = static_cast<std::uint8_t>(value >> 8 & 0xFF);
}

/// Lane k of four carries receiver k: eight words per sample, the first of each of the four, then the second.
void putSample(const LvdsActivity& activity, std::vector<std::uint8_t>& bytes, std::size_t sample, int rx, int i,
               int q) {
  const std::size_t lane = static_cast<std::size_t>(activity.lanes_reversed ? 3 - rx : rx);
  put(bytes, sample * 8 + lane, activity.q_first ? q : i);
  put(bytes, sample * 8 + 4 + lane, activity.q_first ? i : q);
}

double length(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

/// Two-way delay from the transmitter at the origin over the target to receiver `rx`.
double delay_s(const LvdsActivity& activity, const LvdsActivity::Target& target, int rx, double at_s) {
  const double wavelength_m = kLight_m_per_s / activity.start_frequency_hz;
  double p[3];
  for (int axis = 0; axis < 3; ++axis) p[axis] = target.position_m[axis] + target.velocity_m_per_s[axis] * at_s;
  const double* receiver = activity.rx_position_wavelengths[rx];
  return (length(p[0], p[1], p[2]) +
          length(p[0] - receiver[0] * wavelength_m, p[1], p[2] - receiver[1] * wavelength_m)) /
         kLight_m_per_s;
}

}  // namespace

std::vector<std::uint8_t> synthesiseLvds(const LvdsActivity& activity, double elapsed_s) {
  const int chirps = activity.kind == LvdsActivity::Kind::kTestPattern ? 1 : activity.chirps;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(chirps) * static_cast<std::size_t>(activity.samples) * 16);
  std::size_t sample = 0;
  for (int chirp = 0; chirp < chirps; ++chirp) {
    for (int n = 0; n < activity.samples; ++n, ++sample) {
      for (int rx = 0; rx < 4; ++rx) {
        if (activity.kind == LvdsActivity::Kind::kTestPattern) {
          const LvdsActivity::Ramp* const ramp = activity.ramps[rx];
          putSample(activity, bytes, sample, rx, ramp[0].start + n * ramp[0].increment,
                    ramp[1].start + n * ramp[1].increment);
          continue;
        }
        std::complex<double> sum = 0;
        const double ramp_s = activity.adc_start_s + n / activity.sample_rate_hz;
        const double at_s = elapsed_s + chirp * static_cast<double>(activity.chirp_ns) * 1e-9;
        for (const LvdsActivity::Target& target : activity.targets) {
          const double tau_s = delay_s(activity, target, rx, at_s);
          const double turns =
              activity.start_frequency_hz * tau_s + activity.slope_hz_per_s * tau_s * (ramp_s - tau_s / 2);
          sum += std::polar(32767 * std::pow(10.0, target.level_dbfs / 20), 2 * kPi * std::fmod(turns, 1.0));
        }
        const auto clipped = [](double value) {
          return static_cast<int>(std::lround(std::clamp(value, -32768.0, 32767.0)));
        };
        putSample(activity, bytes, sample, rx, clipped(sum.real()), clipped(sum.imag()));
      }
    }
  }
  return bytes;
}

EmulatedLvds::EmulatedLvds(const PlayedSession& session, const Options& options, Log log)
    : session_(session), reader_(session_), options_(options), log_(std::move(log)) {}

void EmulatedLvds::set(const LvdsActivity& activity) {
  using Kind = LvdsActivity::Kind;
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool ran = activity_.kind == Kind::kFrames && !activity_.test_source;
  if (activity_.kind == Kind::kSilent && activity.kind == Kind::kSilent) return;
  activity_ = activity;
  ++run_;
  run_frame_ = 0;
  skip_ = false;
  run_start_ns_ = clock_ns(CLOCK_MONOTONIC) + kTriggerDelay_ns;
  if (ran) log_("frames stop frame=" + std::to_string(session_frame_));
  if (activity.kind == Kind::kFrames && !activity.test_source) {
    const std::size_t bytes = 16u * static_cast<std::size_t>(activity.chirps * activity.samples);
    if (bytes != session_.radar.bytes_per_frame()) {
      log_("error: the radar is configured for frames of " + std::to_string(bytes) + " bytes, and the session has " +
           std::to_string(session_.radar.bytes_per_frame()) +
           ": nothing is sent; give the driver a radar.yaml with "
           "the session's samples, loops and transmitters");
      activity_.kind = Kind::kSilent;
    } else {
      const std::int64_t first_ns = run_start_ns_ + clock_ns(CLOCK_REALTIME) - clock_ns(CLOCK_MONOTONIC);
      log_("frames run first_frame_ns=" + std::to_string(first_ns) + " frame=" + std::to_string(session_frame_) +
           " period_ns=" + std::to_string(activity.period_ns));
    }
  }
  changed_.notify_all();
}

void EmulatedLvds::setRibbon(bool in) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ribbon_ = in;
}

void EmulatedLvds::connected() {
  const std::lock_guard<std::mutex> lock(mutex_);
  skip_ = true;
}

bool EmulatedLvds::over() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return over_;
}

bool EmulatedLvds::next(LvdsFrame& frame) {
  using Kind = LvdsActivity::Kind;
  using SteadyTime = std::chrono::time_point<std::chrono::steady_clock, std::chrono::nanoseconds>;
  std::unique_lock<std::mutex> lock(mutex_);
  const std::uint64_t run = run_;
  const bool done =
      activity_.kind == Kind::kTestPattern && activity_.pattern_packets > 0 && run_frame_ >= activity_.pattern_packets;
  if (activity_.kind == Kind::kSilent || over_ || done) {
    changed_.wait_for(lock, std::chrono::milliseconds(20));
    return false;
  }
  const std::int64_t now_ns = clock_ns(CLOCK_MONOTONIC);
  if (skip_ && now_ns > run_start_ns_) {  // the radar's time went on while nobody listened
    const std::int64_t passed = (now_ns - run_start_ns_) / activity_.period_ns + 1 - run_frame_;
    run_frame_ += passed;
    if (!activity_.test_source) session_frame_ = (session_frame_ + passed) % session_.frames;
  }
  skip_ = false;
  const std::int64_t start_ns = run_start_ns_ + run_frame_ * activity_.period_ns;
  const std::int64_t until_ns = std::min<std::int64_t>(start_ns, now_ns + 20'000'000);
  while (run == run_ && clock_ns(CLOCK_MONOTONIC) < until_ns) {
    changed_.wait_until(lock, SteadyTime(std::chrono::nanoseconds(until_ns)));
  }
  if (run != run_ || until_ns < start_ns) return false;
  frame.start_ns = start_ns;
  fill(frame);
  ++run_frame_;
  return ribbon_;
}

void EmulatedLvds::fill(LvdsFrame& frame) {
  frame.number = session_frame_;
  frame.chirps = activity_.kind == LvdsActivity::Kind::kTestPattern ? 1 : activity_.chirps;
  frame.chirp_ns = activity_.chirp_ns;
  frame.sampled_ns = activity_.sampled_ns;
  if (activity_.kind == LvdsActivity::Kind::kTestPattern || activity_.test_source) {
    frame.bytes = synthesiseLvds(activity_, static_cast<double>(frame.start_ns - run_start_ns_) * 1e-9);
  } else {
    try {
      frame.bytes = reader_.read(session_frame_);
    } catch (const std::runtime_error& error) {
      log_(std::string("warning: ") + error.what());
      frame.bytes.assign(session_.radar.bytes_per_frame(), 0);
    }
    if (++session_frame_ == session_.frames) {
      session_frame_ = 0;
      over_ = options_.once;
    }
  }
  std::uint8_t* const bytes = frame.bytes.data();
  for (std::size_t at = 0; at + 16 <= frame.bytes.size(); at += 16) {
    if (options_.iq_swapped) std::swap_ranges(bytes + at, bytes + at + 8, bytes + at + 8);
    if (!options_.lanes_reversed) continue;
    for (const std::size_t half : {at, at + 8}) {
      std::swap_ranges(bytes + half, bytes + half + 2, bytes + half + 6);
      std::swap_ranges(bytes + half + 2, bytes + half + 4, bytes + half + 4);
    }
  }
}

}  // namespace mmradartwin
