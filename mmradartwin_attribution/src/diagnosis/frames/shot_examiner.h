#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <vector>

#include "diagnosis/frames/frame_laws.h"
#include "diagnosis/frames/frame_stack.h"
#include "diagnosis/frames/moving_cell.h"
#include "diagnosis/frames/residual_spectra.h"
#include "diagnosis/frames/walk_tracker.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::frames {

/// Moving echo of one frame.
struct MovingEcho {
  int frame = 0;
  double range_m = 0, azimuth_rad = 0;
  double snr = 0;             ///< ratio of power to noise after range and angle transforms
  double radial_m_per_s = 0;  ///< away from the radar; NaN where a frame has too few loops
};

/// Statistics of the shots of one pose about their average.
struct ShotStatistics {
  std::vector<double> noise_variance;  ///< [M] of one complex sample, counts^2
  int shots = 0;                       ///< number of shots that were used
  /// Variance of the average over that of noise alone, [N] by range bin; empty where shots differ by noise only.
  std::vector<double> unsteadiness;
  /// [range][azimuth] nats by which a cell varies more than noise.
  Eigen::ArrayXXf evidence;
  std::vector<MovingEcho> echoes;
  std::vector<MovingCell> cells;
  std::vector<FrameLaw> laws;     ///< of what stands; taken out of all that follows
  std::vector<WalkTrack> tracks;  ///< empty where frames have too few loops
  /// Phase per frame that the cells share, beyond the phase that was removed before, and its variance: infinite where
  /// no cell exceeds the noise.
  double turn_rad_per_frame = 0, turn_variance = 0;
  int turn_cells = 0;  ///< number of independent cells that give it
  /// Level [frame] of the whole signal's amplitude over the average; 1 where the signal does not exceed the noise.
  std::vector<double> frame_level;
  /// Share of the range bins with static echoes that vary by more than a tenth beyond noise and the common gain: small
  /// where something moves, near 1 where the radar itself changes.
  double unsteady_share = 0;
  double unsteady_nats = 0;  ///< by which those bins vary more than noise
};

struct DopplerCell;
class DopplerFrame;

/// Examines how shots differ, in range, angle and time.
class ShotExaminer {
 public:
  explicit ShotExaminer(const RadarConfig& radar);
  ShotStatistics examine(const FrameStack& stack, const std::vector<std::complex<float>>& average) const;
  /// Phase from one frame to the next that static echoes share, rad: the median over range bins whose phase follows
  /// from the frame before. 0 where there is no such bin, and with fewer than 3 frames.
  double commonTurn(const FrameStack& stack) const;
  const RangeAngleAxes& axes() const { return chain_.axes(); }

 private:
  ResidualSpectra spectra(const FrameStack& stack, const std::vector<std::complex<float>>& average) const;
  void takeCommonGain(const FrameStack& stack, ResidualSpectra& spectra, ShotStatistics& result) const;
  void takeLaws(const FrameStack& stack, ResidualSpectra& spectra, ShotStatistics& result) const;
  void readSteadiness(const ResidualSpectra& spectra, ShotStatistics& result) const;
  void readNoise(ResidualSpectra& spectra, ShotStatistics& result) const;
  void readUnsteadiness(const ResidualSpectra& spectra, ShotStatistics& result) const;
  void readEvidence(const ResidualSpectra& spectra, ShotStatistics& result) const;
  void readEchoes(const ResidualSpectra& spectra, ShotStatistics& result) const;
  void readDopplerEchoes(const ResidualSpectra& spectra, ShotStatistics& result) const;
  void readTurn(const FrameStack& stack, const ResidualSpectra& spectra, ShotStatistics& result) const;
  /// Adds the whole turns between loops that the track of a walker tells; false where it leaves them open.
  bool unwrap(const std::vector<WalkTrack>& tracks, int frame, DopplerCell& peak) const;
  MovingCell movingCell(const DopplerFrame& frame, const DopplerCell& peak,
                        const std::vector<double>& noise_variance) const;
  /// Echo of a peak. Nothing where no direction holds most of its power, as in a sum of other echoes' sidelobes.
  std::optional<MovingEcho> dopplerEcho(const DopplerFrame& frame, const DopplerCell& peak) const;
  /// Azimuth of the strongest beam's peak, interpolated between beams.
  double azimuth_rad(const Eigen::VectorXf& beam, int strongest) const;
  Eigen::VectorXcf steering(double azimuth_rad) const;

  RadarConfig radar_;
  SignalChain chain_;
  std::vector<float> window_;
  Eigen::MatrixXcf beams_;  ///< [M][64] array responses
};

}  // namespace mmradartwin::diagnosis::frames
