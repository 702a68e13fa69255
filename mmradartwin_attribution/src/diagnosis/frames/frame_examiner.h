#pragma once

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

/// What raw samples and frames show that no average shows.
struct FrameFinding {
  /// adc_saturation, packet_loss, packet_misalignment, interference, moving_target or phase_drift; "unknown" among
  /// FrameExaminer::unexplained().
  std::string cause;
  std::vector<FindingParameter> parameters;  ///< with the cause's names and units
  double log_likelihood_gain = 0;            ///< nats of the frame data
  double false_alarm_rate = 1;               ///< upper bound for the whole session
  std::vector<std::string> poses;            ///< that carry it
  std::vector<FindingPlace> where;
  std::string description;  ///< in words and numbers
  /// Among FrameExaminer::unexplained(): the twin's term for it where there is one (level_db over one ADC count).
  std::optional<NamedParameters> mechanism;
  /// Where it is told pose by pose, the nats that it explains at each, by its name; of a term of unexplained() as the
  /// poses of other locations tell it.
  std::map<std::string, double> nats_by_pose;
};

/// Channels of an echo that moves, by range and Doppler, of a radar with many loops per frame.
struct MovingCell {
  int bin = 0;                ///< of range
  double turn_rad = 0;        ///< from one transmitter's slot to the next
  double power = 0;           ///< over the noise
  Eigen::VectorXcd channels;  ///< [M] as delivered, of any common level
};

/// What the frames of one pose come to once damaged samples are left out.
struct PoseFrames {
  std::string pose;
  /// Average in ADC counts [M][N], as CoherentAverage's, without lost, clipped and disturbed samples, slips closed and
  /// frames turned back. Zero where a sample was never fit for use; as delivered where it was always clipped.
  ReceiveGrid mean;
  /// Thermal noise [M]: variance of one complex sample of one shot in counts^2, robust against what moves; rounding
  /// leaves at least 1/6. The mean carries this over `shots`.
  std::vector<double> noise_variance;
  int shots = 0;  ///< whole ones, of frames x loops
  /// [N] of range: variance of the mean over that of noise alone, 1 but where something moves; empty where nothing
  /// does.
  std::vector<double> unsteadiness;
  std::vector<MovingCell> moving;
};

/// One streaming pass over a session's captures, pose after pose; keeps statistics, no samples. It needs no scene: raw
/// bytes, then frames against each other.
class FrameExaminer {
 public:
  /// Throws InputError where the virtual array is no uniform line along y.
  explicit FrameExaminer(const RadarConfig& radar);
  ~FrameExaminer();
  FrameExaminer(FrameExaminer&&) noexcept;
  FrameExaminer& operator=(FrameExaminer&&) noexcept;

  /// `frames`: all of the pose, in order. Throws InputError where one has not the radar's shape.
  void addPose(const Pose& pose, const std::vector<AdcCube>& frames);
  /// By falling gain; empty on a clean session.
  std::vector<FrameFinding> findings() const;
  /// What differs between frames and is none of the six: body-fixed tones, frames whose common gain changes.
  std::vector<FrameFinding> unexplained() const;
  const std::vector<PoseFrames>& poses() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mmradartwin::diagnosis::frames
