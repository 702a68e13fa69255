#pragma once

#include <memory>
#include <string>
#include <vector>

#include "diagnosis/frames/frame_finding.h"
#include "diagnosis/frames/moving_cell.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/adc_cube.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin::diagnosis::frames {

/// Average and statistics of the frames of one pose without damaged samples.
struct PoseFrames {
  std::string pose;
  /// Average in ADC counts [M][N] as CoherentAverage forms it, but without lost, clipped and disturbed samples, with
  /// slips closed and the phase drift of frames removed. Samples that were never usable are zero. Samples that always
  /// clipped are as delivered.
  ReceiveGrid mean;
  /// Noise variance [M] of one complex sample of one shot in counts^2, without the scatter of moving echoes; at least
  /// 1/6, which is rounding. The mean has this divided by `shots`.
  std::vector<double> noise_variance;
  int shots = 0;  ///< number of complete shots among frames x loops
  /// Variance of the mean over that of noise alone, [N] by range bin: 1 where nothing moves. Empty where nothing moves
  /// in any bin.
  std::vector<double> unsteadiness;
  std::vector<MovingCell> moving;
};

/// Examines a session's frames pose by pose, and keeps statistics but no samples. It needs no scene: it judges raw
/// bytes, then frames relative to each other.
class FrameExaminer {
 public:
  /// Throws InputError where the virtual array is no uniform line along y.
  explicit FrameExaminer(const RadarConfig& radar);
  ~FrameExaminer();
  FrameExaminer(FrameExaminer&&) noexcept;
  FrameExaminer& operator=(FrameExaminer&&) noexcept;

  /// Examines all frames of a pose, in order. Throws InputError where a frame does not have the radar's shape.
  void addPose(const Pose& pose, const std::vector<AdcCube>& frames);
  /// Findings with a cause, by falling gain; empty for a clean session.
  std::vector<FrameFinding> findings() const;
  /// Differences between frames that have none of the six causes: body-fixed tones, and frames whose common gain
  /// changes.
  std::vector<FrameFinding> unexplained() const;
  const std::vector<PoseFrames>& poses() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mmradartwin::diagnosis::frames
