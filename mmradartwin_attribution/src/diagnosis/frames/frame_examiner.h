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
  /// Average in ADC counts [M][N], as CoherentAverage makes it, but without lost, clipped and disturbed samples, with
  /// slips closed and frames turned back. Samples that were never fit for use are zero; samples that always clipped are
  /// as delivered.
  ReceiveGrid mean;
  /// Noise variance [M] of one complex sample of one shot in counts^2, which movers do not raise; at least the 1/6 of
  /// rounding. The mean carries this over `shots`.
  std::vector<double> noise_variance;
  int shots = 0;  ///< number of whole shots among frames x loops
  /// Ratio [N] by range bin of the mean's variance to that of noise alone: 1 where nothing moves. Empty where nothing
  /// moves in any bin.
  std::vector<double> unsteadiness;
  std::vector<MovingCell> moving;
};

/// Examiner of a session's frames, pose after pose, which keeps statistics and no samples. It needs no scene: it looks
/// at raw bytes, then at frames against each other.
class FrameExaminer {
 public:
  /// Throws InputError where the virtual array is no uniform line along y.
  explicit FrameExaminer(const RadarConfig& radar);
  ~FrameExaminer();
  FrameExaminer(FrameExaminer&&) noexcept;
  FrameExaminer& operator=(FrameExaminer&&) noexcept;

  /// Examines all frames of a pose, in order. Throws InputError where one has not the radar's shape.
  void addPose(const Pose& pose, const std::vector<AdcCube>& frames);
  /// Findings with a cause, by falling gain; empty for a clean session.
  std::vector<FrameFinding> findings() const;
  /// Differences between frames that are none of the six causes: body-fixed tones, frames whose common gain changes.
  std::vector<FrameFinding> unexplained() const;
  const std::vector<PoseFrames>& poses() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mmradartwin::diagnosis::frames
