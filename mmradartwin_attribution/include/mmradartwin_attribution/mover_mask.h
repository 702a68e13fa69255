#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "mmradartwin_attribution/response.h"
#include "mmradartwin_dsp/cfar.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// Cells of a measured map that walkers may have changed. A twin knows nobody who walks, so they are not compared.
///
/// A walker is taken to fill kWalkerHalfWidth_m of range to either side of each moving detection, a stride, whose
/// standing foot does not move: within a beam and a half of the angle at its level, and at all other angles
/// kMoverSidelobe_db below that. In an average of K frames a detection of power P in F of the n frames that were
/// searched leaves F P/(n K) on average, since its phase is another one in each. A cell is masked where that lies less
/// than kMoverMargin_db below its level, or below the threshold of weak responses where that is higher.
class MoverMask {
 public:
  explicit MoverMask(const RadarConfig& radar);

  /// Detections of a frame, in any order; those that stand still or have no speed do not count. Stamps that go back
  /// begin anew.
  void add(std::int64_t stamp_ns, const std::vector<Detection>& detections);
  /// Sets cells of the measured map to NaN; detections of the time of its average count. Returns how many.
  int apply(const EvaluationField& field, RangeAngleMap& measured) const;

 private:
  struct Frame {
    std::int64_t stamp_ns;
    std::vector<Detection> movers;
  };
  int half_range_bins_, near_bins_;
  std::int64_t frame_period_ns_;
  std::deque<Frame> frames_;
};

constexpr double kWalkerHalfWidth_m = 0.4;
/// Sidelobes of the array, some -11 dB, of what of a walker is slow enough for the average, which is less than all.
constexpr double kMoverSidelobe_db = 20;
/// An amplitude of 0.3 beside the cell's own changes it by 3 dB at most.
constexpr double kMoverMargin_db = 10;

}  // namespace mmradartwin
