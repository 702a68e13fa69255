#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <vector>

#include "diagnosis/frames/frame_stack.h"
#include "diagnosis/frames/moving_cell.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::frames {

/// Moving echo of one frame.
struct MovingEcho {
  int frame = 0;
  double range_m = 0, azimuth_rad = 0;
  double snr = 0;             ///< ratio of power to noise after range and angle transforms
  double radial_m_per_s = 0;  ///< away from the radar; NaN where a frame has too few loops to tell
};

/// Statistics of the shots of one pose beside their average.
struct ShotStatistics {
  std::vector<double> noise_variance;  ///< [M] of one complex sample, counts^2
  int shots = 0;                       ///< number of those that were used
  /// Ratio [N] by range bin of the average's variance to that of noise alone; empty where shots differ by no more than
  /// noise.
  std::vector<double> unsteadiness;
  /// Nats by which a cell [range][azimuth] varies more than noise does.
  Eigen::ArrayXXf evidence;
  std::vector<MovingEcho> echoes;
  std::vector<MovingCell> cells;
  /// Turn per frame that the cells agree on, beyond the turn that was taken out before, and its variance: infinite
  /// where no cell stands out of the noise.
  double turn_rad_per_frame = 0, turn_variance = 0;
  int turn_cells = 0;  ///< number of independent cells that it was read from
  /// Level [frame] of the whole signal's amplitude against the average; 1 where the signal does not stand out of the
  /// noise.
  std::vector<double> frame_level;
  /// Share of the range bins with standing echoes that vary by more than a tenth of themselves beyond noise and beyond
  /// the common gain: few where something moves, most where the radar itself changes.
  double unsteady_share = 0;
  double unsteady_nats = 0;  ///< by which those bins vary more than noise does
};

/// Examiner of how shots differ, in range, angle and time.
class ShotExaminer {
 public:
  explicit ShotExaminer(const RadarConfig& radar);
  ShotStatistics examine(const FrameStack& stack, const std::vector<std::complex<float>>& average) const;
  /// Turn from one frame to the next that standing echoes share, rad: the median over range bins whose phase follows
  /// from the frame before. 0 where there is no such bin, and with fewer than 3 frames.
  double commonTurn(const FrameStack& stack) const;
  const RangeAngleAxes& axes() const { return chain_.axes(); }

 private:
  struct Spectra;
  struct DopplerCell;
  class DopplerFrame;
  Spectra spectra(const FrameStack& stack, const std::vector<std::complex<float>>& average) const;
  void takeCommonGain(const FrameStack& stack, Spectra& spectra, ShotStatistics& result) const;
  void readSteadiness(const Spectra& spectra, ShotStatistics& result) const;
  void readNoise(Spectra& spectra, ShotStatistics& result) const;
  void readUnsteadiness(const Spectra& spectra, ShotStatistics& result) const;
  void readEvidence(const Spectra& spectra, ShotStatistics& result) const;
  void readEchoes(const Spectra& spectra, ShotStatistics& result) const;
  void readDopplerEchoes(const Spectra& spectra, ShotStatistics& result) const;
  void readTurn(const FrameStack& stack, const Spectra& spectra, ShotStatistics& result) const;
  MovingCell movingCell(const DopplerFrame& frame, const DopplerCell& peak,
                        const std::vector<double>& noise_variance) const;
  /// Echo of a peak; nothing where no direction holds most of its power, as of a sum of other echoes' sidelobes.
  std::optional<MovingEcho> dopplerEcho(const DopplerFrame& frame, const DopplerCell& peak) const;
  /// Azimuth of the strongest beam's peak, between beams.
  double azimuth_rad(const Eigen::VectorXf& beam, int strongest) const;
  Eigen::VectorXcf steering(double azimuth_rad) const;

  RadarConfig radar_;
  SignalChain chain_;
  std::vector<float> window_;
  Eigen::MatrixXcf beams_;  ///< [M][64] array responses
};

}  // namespace mmradartwin::diagnosis::frames
