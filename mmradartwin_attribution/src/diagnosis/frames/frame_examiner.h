#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_dsp/adc_cube.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin::diagnosis::frames {

/// Finding from raw samples and frames, which averages do not show.
struct FrameFinding {
  /// adc_saturation, packet_loss, packet_misalignment, interference, moving_target or phase_drift; "unknown" for
  /// FrameExaminer::unexplained().
  std::string cause;
  std::vector<FindingParameter> parameters;  ///< with the names of the cause's parameters
  double log_likelihood_gain = 0;            ///< nats of the frame data
  double false_alarm_rate = 1;               ///< upper bound for the whole session
  std::vector<std::string> poses;            ///< names of those that carry it
  std::vector<FindingPlace> where;
  std::string description;  ///< in words and numbers
  /// Mechanism of the twin for an unexplained() finding, where there is one. level_db is relative to one ADC count.
  std::optional<NamedParameters> mechanism;
  /// Nats that it explains at each pose, by the pose's name; empty where it is not measured by pose. Nats of an
  /// unexplained() finding are held out: their numbers come from poses of other locations.
  std::map<std::string, double> nats_by_pose;
};

/// Moving echo: one cell of range and Doppler of a frame with many loops.
struct MovingCell {
  int bin = 0;                ///< range bin
  double turn_rad = 0;        ///< phase from one transmitter's slot to the next
  double power = 0;           ///< ratio to the noise
  Eigen::VectorXcd channels;  ///< [M] as delivered, up to a common factor
};

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
