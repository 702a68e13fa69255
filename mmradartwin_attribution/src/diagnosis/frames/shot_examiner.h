#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "diagnosis/frames/frame_examiner.h"
#include "diagnosis/frames/frame_stack.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::frames {

/// One frame's strongest moving echoes, or one of a frame with many loops.
struct MovingEcho {
  int frame = 0;
  double range_m = 0, azimuth_rad = 0;
  double snr = 0;             ///< power over noise after range and angle transforms
  double radial_m_per_s = 0;  ///< away from the radar; NaN where a frame has too few loops to tell
};

/// What the shots of one pose say beyond their average.
struct ShotStatistics {
  std::vector<double> noise_variance;  ///< [M] of one complex sample, counts^2
  int shots = 0;                       ///< that were used
  /// [N] of range: variance of the average over that of noise alone; empty where shots differ by no more than noise.
  std::vector<double> unsteadiness;
  /// Nats by which cell [range][azimuth] varies more than noise does.
  Eigen::ArrayXXf evidence;
  std::vector<MovingEcho> echoes;
  std::vector<MovingCell> cells;
  /// Turn per frame that the cells agree on beyond the turn taken out before, and its variance; infinite where no cell
  /// stands out of the noise.
  double turn_rad_per_frame = 0, turn_variance = 0;
  int turn_cells = 0;  ///< independent ones that it was read from
  /// [frame] level of the whole signal against the average, amplitude; 1 where the signal does not stand out of the
  /// noise.
  std::vector<double> frame_level;
  /// Of the range bins with standing echoes, those that vary by more than a tenth of themselves beyond noise and beyond
  /// what all share: few where something moves, most where the radar itself changes.
  double unsteady_share = 0;
  double unsteady_nats = 0;  ///< by which those bins vary more than noise does
};

/// Looks at what the shots differ by, in range, angle and time.
class ShotExaminer {
 public:
  explicit ShotExaminer(const RadarConfig& radar);
  ShotStatistics examine(const FrameStack& stack, const std::vector<std::complex<float>>& average) const;
  /// Turn from one frame to the next that standing echoes share, rad: the median over the range bins whose phase
  /// follows from the frame before. 0 where there is none such or fewer than 3 frames.
  double commonTurn(const FrameStack& stack) const;
  const RangeAngleAxes& axes() const { return chain_.axes(); }

 private:
  struct Spectra;
  Spectra spectra(const FrameStack& stack, const std::vector<std::complex<float>>& average) const;
  void takeCommonGain(const FrameStack& stack, Spectra& spectra, ShotStatistics& result) const;
  void readSteadiness(const Spectra& s, ShotStatistics& result) const;
  void readNoise(Spectra& spectra, ShotStatistics& result) const;
  void readUnsteadiness(const Spectra& spectra, ShotStatistics& result) const;
  void readEvidence(const Spectra& spectra, ShotStatistics& result) const;
  void readEchoes(const Spectra& spectra, ShotStatistics& result) const;
  void readDopplerEchoes(const Spectra& spectra, ShotStatistics& result) const;
  void readTurn(const FrameStack& stack, const Spectra& spectra, ShotStatistics& result) const;
  Eigen::VectorXcf steering(double azimuth_rad) const;

  RadarConfig radar_;
  SignalChain chain_;
  std::vector<float> window_;
  Eigen::MatrixXcf beams_;  ///< [M][64]
};

}  // namespace mmradartwin::diagnosis::frames
