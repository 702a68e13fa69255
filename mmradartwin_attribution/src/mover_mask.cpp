#include "mmradartwin_attribution/mover_mask.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mmradartwin {
namespace {

/// Frames that are kept for the longest average.
constexpr std::size_t kMostFrames = 10000;

}  // namespace

MoverMask::MoverMask(const RadarConfig& radar)
    : half_range_bins_(std::max(1, static_cast<int>(std::lround(kWalkerHalfWidth_m / radar.range_bin_m())))),
      near_bins_(3 * Cfar(CfarSettings(), radar).beamBins() / 2),
      frame_period_ns_(std::llround(radar.frame_period_s * 1e9)) {}

void MoverMask::add(std::int64_t stamp_ns, const std::vector<Detection>& detections) {
  if (!frames_.empty() && stamp_ns <= frames_.back().stamp_ns) frames_.clear();
  Frame frame{stamp_ns, {}};
  for (const Detection& detection : detections) {
    if (std::abs(detection.radial_speed_m_per_s) > 0) frame.movers.push_back(detection);  // no, where it is NaN
  }
  frames_.push_back(std::move(frame));
  if (frames_.size() > kMostFrames) frames_.pop_front();
}

int MoverMask::apply(const EvaluationField& field, RangeAngleMap& measured) const {
  const int ranges = static_cast<int>(measured.power_db.rows()), angles = static_cast<int>(measured.power_db.cols());
  RealGrid moved = RealGrid::Zero(ranges, angles);  // sum of powers over frames
  const std::int64_t averaged = std::max(1, measured.frames);
  const std::int64_t before_ns = measured.stamp_ns - averaged * frame_period_ns_ + frame_period_ns_ / 2;
  const double sidelobe = std::pow(10.0, -kMoverSidelobe_db / 10);
  int searched = 0;
  for (auto frame = frames_.rbegin(); frame != frames_.rend() && frame->stamp_ns > before_ns; ++frame) {
    if (frame->stamp_ns > measured.stamp_ns) continue;
    ++searched;
    RealGrid of_frame = RealGrid::Zero(ranges, angles);  // a walker with several speeds is there once
    for (const Detection& mover : frame->movers) {
      const double power = std::pow(10.0, mover.power_db / 10);
      for (int r = std::max(0, mover.range_bin - half_range_bins_);
           r <= std::min(ranges - 1, mover.range_bin + half_range_bins_); ++r) {
        for (int a = 0; a < angles; ++a) {
          const bool beside = std::abs(a - mover.angle_bin) > near_bins_;
          of_frame(r, a) = std::max(of_frame(r, a), beside ? sidelobe * power : power);
        }
      }
    }
    moved += of_frame;
  }
  const double weak_db = field.normalise(measured).peak_db + field.config().weak_db;
  const double spread_db = 10 * std::log10(static_cast<double>(std::max(1, searched) * averaged));
  int masked = 0;
  for (int r = 0; r < ranges; ++r) {
    for (int a = 0; a < angles; ++a) {
      if (!(moved(r, a) > 0)) continue;
      const double moved_db = 10 * std::log10(moved(r, a)) - spread_db;
      if (moved_db < std::max(measured.power_db(r, a), weak_db) - kMoverMargin_db) continue;
      measured.power_db(r, a) = std::numeric_limits<double>::quiet_NaN();
      ++masked;
    }
  }
  return masked;
}

}  // namespace mmradartwin
