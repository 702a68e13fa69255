#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "mmradartwin_dsp/adc_cube.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"

namespace mmradartwin {

/// Sliding coherent average over loops and the last `max_frames` frames, per TDM slot. Chirps that are not valid carry
/// weight zero. Cost per frame is independent of max_frames; sums are integers, so sliding does not accumulate error.
class CoherentAverage {
 public:
  /// max_frames = 0: no limit (a whole capture).
  CoherentAverage(const RadarConfig& radar, int max_frames);
  /// Throws InputError where the cube's shape is not the radar's.
  void add(const AdcCube& cube);
  /// Begins anew: the radar has moved or was reconfigured.
  void reset();
  int frames() const;
  /// True where every slot has at least one valid chirp.
  bool complete() const;
  /// The average in ADC counts [M][N]. Throws InputError where !complete(), naming the slot.
  ReceiveGrid grid() const;

 private:
  struct Frame {
    std::vector<std::int32_t> sum;     // [M][N][2]
    std::vector<std::int32_t> weight;  // [slot] valid chirps
    std::int64_t stamp_ns = 0;
  };
  void sumOverLoops(const AdcCube& cube, Frame& frame) const;

  RadarConfig radar_;
  int max_frames_;
  std::deque<Frame> window_;
  std::vector<std::int64_t> sum_;     // [M][N][2]
  std::vector<std::int64_t> weight_;  // [slot]
  int frames_ = 0;
  std::int64_t stamp_ns_ = 0;
};

}  // namespace mmradartwin
