#pragma once

#include <limits>
#include <vector>

#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin {

enum class CfarKind {
  kCellAveraging,    ///< CA: the mean of the training cells
  kOrderedStatistic  ///< OS: one of them by rank, which a few strong neighbours do not change
};

struct CfarSettings {
  CfarKind kind = CfarKind::kOrderedStatistic;
  double false_alarm_rate = 1e-4;  ///< of a cell that holds noise alone, (0, 0.5]
  double guard_m = 0.5;            ///< along range, to either side: left out around the cell
  double training_m = 2;           ///< along range, to either side, beyond the guard
  int guard_beams = 1;             ///< along the angle, to either side
  int training_beams = 2;          ///< along the angle, to either side, beyond the guard; 0 with no guard: range alone
  double rank_share = 0.75;        ///< OS: the rank, as a share of the training cells
  double sidelobe_db = 12;  ///< weaker ones than the strongest cell of their range by more are taken as its sidelobes
};
/// Throws InputError, which names key, value and allowed range.
void check(const CfarSettings& settings);

/// What the mean of `cells` training cells is multiplied by: N (P^(-1/N) - 1). Richards, Fundamentals of Radar Signal
/// Processing, ch. 7.
double cellAveragingFactor(double false_alarm_rate, int cells);
/// What the training cell of this rank (1: the weakest) is multiplied by: the alpha that solves
/// P = prod_{i=0}^{rank-1} (N-i)/(N-i+alpha). Richards, ch. 7; Rohling 1983.
double orderedStatisticFactor(double false_alarm_rate, int cells, int rank);
/// Mean of the cell of this rank among so many, in units of the noise's power: sum_{i=0}^{rank-1} 1/(N-i).
double orderedStatisticMean(int cells, int rank);

struct Detection {
  int range_bin = 0, angle_bin = 0;
  double range_m = 0, azimuth_rad = 0;
  double power_db = 0;  ///< dBFS
  double snr_db = 0;    ///< power of the cell over that of the noise around it, (S+N)/N
  /// Positive: the range grows. NaN where no frame told it.
  double radial_speed_m_per_s = std::numeric_limits<double>::quiet_NaN();
};

/// Cells that stand above what is around them, at a constant rate of false alarms (CFAR).
///
/// The law of a cell's noise is taken as exponential: a map is the power of one coherent sum over channels, loops and
/// frames, so an average of K frames lowers the noise and leaves its law as it is; RangeAngleMap::frames does not
/// enter. The training cells are independent of each other and of the cell: the Hann window joins only cells of up to
/// two bins of range, and beams are 64/M bins of angle apart, M the length of the array in pitches. Thus every third
/// bin of range and every beam is taken, and the thresholds of white noise hold. Where M does not divide 64 the beams
/// are a little farther apart, and not quite independent.
class Cfar {
 public:
  /// Throws InputError where settings are out of range, or the radar has no uniform line.
  Cfar(const CfarSettings& settings, const RadarConfig& radar);

  struct Levels {
    RealGrid noise_db;      ///< NaN where a cell is masked or has no training cell
    RealGrid threshold_db;  ///< the same
  };
  /// Of a map's power_db; cells that are NaN are masked. At the edges there are fewer training cells, and the threshold
  /// is that of their number. Noise below `least_noise_db` is taken as that.
  Levels levels(const RealGrid& power_db, double least_noise_db = -std::numeric_limits<double>::infinity()) const;
  /// Cells that exceed the threshold and are the strongest within a bin of range and half a beam, which is less than
  /// what the radar resolves. In order of range and angle.
  std::vector<Detection> detect(const RangeAngleMap& map,
                                double least_noise_db = -std::numeric_limits<double>::infinity()) const;
  /// The level of noise that a tenth of a map's independent cells stay below: what the receiver's own noise is at most.
  /// A simulated map has none, and takes it from the measured one. NaN where no cell has a level.
  double noiseFloor_db(const RealGrid& power_db) const;
  /// Bins of angle from one beam to the next, of which a line has one per pitch.
  int beamBins() const { return beam_bins_; }
  /// Training cells of a cell far from all edges.
  int trainingCells() const { return static_cast<int>(offsets_.size()); }

 private:
  struct Offset {
    int range_bins, angle_bins;
  };
  struct Factor {
    int rank = 0;                   ///< OS: from 1
    double noise_per_level_db = 0;  ///< noise power over the mean, or the cell of that rank
    double threshold_per_noise_db = 0;
  };
  struct Level {
    double noise_db = std::numeric_limits<double>::quiet_NaN();
    double threshold_db = std::numeric_limits<double>::quiet_NaN();
  };
  /// Of a cell that is not masked, in a map of powers that are no levels; `training` is room for the cells around it.
  Level levelAt(const RealGrid& power, Eigen::Index range_bin, Eigen::Index angle_bin, double least_noise_db,
                std::vector<double>& training) const;
  /// False where a few training cells tell already that the cell does not exceed its threshold.
  bool mayExceed(const RealGrid& power, Eigen::Index range_bin, Eigen::Index angle_bin) const;

  CfarSettings settings_;
  std::vector<Offset> offsets_;
  int beam_bins_ = 1;
  std::vector<Factor> factors_;  ///< by number of training cells
  double least_threshold_ =
      0;  ///< over the sum of the training cells (CA), or the ranked one (OS), for any number of them
  int most_above_rank_ = 0;  ///< OS: training cells above the ranked one, for any number of them
};

}  // namespace mmradartwin
