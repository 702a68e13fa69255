#pragma once

#include <vector>

#include "mmradartwin_dsp/cfar.h"
#include "mmradartwin_dsp/range_doppler.h"

namespace mmradartwin {

/// The sidelobes of Hann's window over the loops lie at -31 dB and below.
constexpr double kDopplerSidelobe_db = 30;

/// Detections with their radial speed: what stands still is found in the average over frames, what moves in the
/// range-angle maps of the last frame's single bins of speed.
///
/// The rate of false alarms is that of a cell of range and angle: each of the L bins of speed is searched at an L-th of
/// it, so that all bins together have it once more. What moves lies more than kStillBins from speed 0.
class PointDetector {
 public:
  /// Throws InputError as Cfar does.
  PointDetector(const CfarSettings& settings, const RadarConfig& radar);

  /// Of a map alone, without speeds (NaN).
  std::vector<Detection> still(const RangeAngleMap& average) const { return still_.detect(average); }
  /// Cells that exceed their threshold and are the strongest within a bin of range, half a beam and a bin of speed.
  /// What lies kDopplerSidelobe_db below the strongest cell within a bin of range and a beam, of any speed, is taken as
  /// that one's sidelobe.
  std::vector<Detection> moving(const SignalChain& chain, const DopplerGrids& frame) const;
  /// moving(), and still() with speed 0. A walker leaks into the average: what is found there within a bin of range and
  /// a beam of a stronger moving detection is left out.
  std::vector<Detection> all(const SignalChain& chain, const RangeAngleMap& average, const DopplerGrids& frame) const;

 private:
  Cfar still_, moving_;
};

}  // namespace mmradartwin
