#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// When frames began, from when packets arrived.
///
/// The card sends a full packet at the moment its last byte has come over LVDS, which is when the chirp that holds this
/// byte has been sampled. So a packet whose last byte lies in chirp c of frame g left at
///   start(g) + c * T + t_s,   T = idle + ramp_end,   t_s = idle + adc_start + N / f_s,
/// and start(f) = start(g) - (g - f) * frame_period for a frame f that begins in the same packet. Where radar.yaml does
/// not give idle_s and ramp_end_s, idle = 0 and T = adc_start + N / f_s stand in, which makes the stamp late by the
/// difference. The few microseconds on LVDS and on the wire stay in the stamp.
/// (That packets leave so is seen in a capture of a real card: 16 chirps of 1024 bytes, packets 1 or 2 chirps apart.)
///
/// Arrival is never early, only late. So the starts lie on or above a straight line, whose slope is the true frame
/// period by this host's clock: the line under all observations of the last kWindow that is nearest to them (the edge
/// of their lower convex hull below their mean; Moon, Skelly and Towsley 1999 estimate clock skew so). Its stamp is
/// taken where it is earlier than the observation. Until the line rests on kEnough observations, the earlier one of
/// observation and prediction from the frame before is taken; the prediction runs slow by `drift` so that it follows a
/// radar whose crystal is slower than this clock. An observation more than half a frame period late is believed: the
/// radar has paused, and the line begins anew.
class FrameClock {
 public:
  explicit FrameClock(const RadarConfig& radar, double drift = 1e-4);

  /// Start of frame `frame` by a packet that ended with byte `last_byte` (both counted from the recording's start) and
  /// arrived at `stamp_ns`.
  std::int64_t startFromPacket(std::uint64_t frame, std::uint64_t last_byte, std::int64_t stamp_ns) const;

  /// Takes an observed start and returns the stamp for this frame. Frames come in ascending order.
  std::int64_t observe(std::uint64_t frame, std::int64_t start_ns);
  /// Stamp of a frame without an observation; nothing before the first one.
  std::optional<std::int64_t> predict(std::uint64_t frame) const;
  void reset();

  static constexpr std::size_t kWindow = 400, kEnough = 60;

 private:
  struct Observation {
    std::uint64_t frame;
    double late_ns;  ///< relative to frames at the nominal period from the first observation on
  };
  /// The line's value at a frame, in the same terms; nothing while it rests on too few observations.
  std::optional<double> fittedLate_ns(std::uint64_t frame) const;
  std::uint64_t frame_bytes_, chirp_bytes_;
  double period_ns_, chirp_ns_, sampled_ns_, drift_;
  bool known_ = false;
  std::uint64_t frame_ = 0;
  std::int64_t start_ns_ = 0;
  std::uint64_t origin_frame_ = 0;
  std::int64_t origin_ns_ = 0;
  std::deque<Observation> observations_;
};

}  // namespace mmradartwin
