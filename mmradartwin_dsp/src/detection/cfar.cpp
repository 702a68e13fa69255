#include "mmradartwin_dsp/cfar.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <string>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin {
namespace {

constexpr int kIndependentRange_bins = 3;  // the Hann window joins cells of up to two bins
constexpr double kFloorShare = 0.1;
constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

void checkRange(const std::string& key, double value, double low, double high) {
  if (value >= low && value <= high) return;
  std::ostringstream text;
  text << key << ": " << value << " is out of range; allowed: " << low << " to " << high;
  throw InputError(text.str());
}

double decibels(double power) { return 10 * std::log10(power); }

/// True where no cell within a bin of range and so many of angle is stronger; of equal ones the first counts.
bool isLocalMaximum(const RealGrid& power_db, Eigen::Index r, Eigen::Index a, Eigen::Index angle_bins) {
  const Eigen::Index last_angle = std::min(a + angle_bins, power_db.cols() - 1);
  for (Eigen::Index i = std::max<Eigen::Index>(r - 1, 0); i <= std::min(r + 1, power_db.rows() - 1); ++i) {
    for (Eigen::Index j = std::max<Eigen::Index>(a - angle_bins, 0); j <= last_angle; ++j) {
      if (i == r && j == a) continue;
      const bool before = i < r || (i == r && j < a);
      if (power_db(i, j) > power_db(r, a) || (before && power_db(i, j) == power_db(r, a))) return false;
    }
  }
  return true;
}

/// The strongest cell of each range and those next to it; what is no cell is passed over.
std::vector<double> strongestByRange_db(const RealGrid& power_db) {
  const Eigen::Index ranges = power_db.rows();
  std::vector<double> of_row(static_cast<std::size_t>(ranges), -std::numeric_limits<double>::infinity());
  for (Eigen::Index r = 0; r < ranges; ++r) {
    for (Eigen::Index a = 0; a < power_db.cols(); ++a) {
      if (power_db(r, a) > of_row[static_cast<std::size_t>(r)]) of_row[static_cast<std::size_t>(r)] = power_db(r, a);
    }
  }
  std::vector<double> strongest = of_row;
  for (std::size_t r = 1; r < of_row.size(); ++r) {
    strongest[r] = std::max(strongest[r], of_row[r - 1]);
    strongest[r - 1] = std::max(strongest[r - 1], of_row[r]);
  }
  return strongest;
}

}  // namespace

void check(const CfarSettings& settings) {
  checkRange("false_alarm_rate", settings.false_alarm_rate, 1e-12, 0.5);
  checkRange("guard_m", settings.guard_m, 0, 100);
  checkRange("training_m", settings.training_m, 0.01, 100);
  checkRange("guard_beams", settings.guard_beams, 0, kAngleBins);
  checkRange("training_beams", settings.training_beams, 0, kAngleBins);
  checkRange("rank_share", settings.rank_share, 0.01, 1);
  checkRange("sidelobe_db", settings.sidelobe_db, 0, 400);
}

double cellAveragingFactor(double false_alarm_rate, int cells) {
  return cells * std::expm1(-std::log(false_alarm_rate) / cells);
}

double orderedStatisticFactor(double false_alarm_rate, int cells, int rank) {
  const auto logRate = [&](double alpha) {
    double sum = 0;
    for (int i = 0; i < rank; ++i) sum -= std::log1p(alpha / (cells - i));
    return sum;
  };
  const double wanted = std::log(false_alarm_rate);
  double low = 0, high = 1;
  while (logRate(high) > wanted) low = high, high *= 2;
  while (high - low > 1e-13 * high) {
    const double middle = (low + high) / 2;
    if (middle == low || middle == high) break;
    (logRate(middle) > wanted ? low : high) = middle;
  }
  return (low + high) / 2;
}

double orderedStatisticMean(int cells, int rank) {
  double sum = 0;
  for (int i = 0; i < rank; ++i) sum += 1.0 / (cells - i);
  return sum;
}

Cfar::Cfar(const CfarSettings& settings, const RadarConfig& radar) : settings_(settings) {
  check(settings);
  const VirtualLine line = radar.virtualLine();
  const int length = 1 + *std::max_element(line.places.begin(), line.places.end());
  const int beam_bins = std::max(1, (kAngleBins + length - 1) / length);
  peak_angle_bins_ = std::max(1, beam_bins / 2);
  const auto bins = [&](double length_m) {
    return static_cast<int>(std::min<long>(std::lround(length_m / radar.range_bin_m()), radar.samples_per_chirp));
  };
  const int guard_bins = std::max(kIndependentRange_bins - 1, bins(settings.guard_m));
  // At least one training cell on either side.
  const int nearest = guard_bins / kIndependentRange_bins + 1;
  const int farthest = std::max(nearest, (guard_bins + bins(settings.training_m)) / kIndependentRange_bins);
  const int beams = std::min(settings.guard_beams + settings.training_beams, kAngleBins);
  for (int i = -farthest; i <= farthest; ++i) {
    for (int j = -beams; j <= beams; ++j) {
      if (std::abs(i) < nearest && std::abs(j) <= settings.guard_beams) continue;
      if (std::abs(j) * beam_bins >= kAngleBins) continue;
      offsets_.push_back({i * kIndependentRange_bins, j * beam_bins});
    }
  }
  factors_.resize(offsets_.size() + 1);
  for (int cells = 1; cells <= trainingCells(); ++cells) {
    Factor& factor = factors_[static_cast<std::size_t>(cells)];
    if (settings.kind == CfarKind::kCellAveraging) {
      factor.noise_per_level = 1;
      factor.threshold_per_noise = cellAveragingFactor(settings.false_alarm_rate, cells);
    } else {
      factor.rank = std::clamp(static_cast<int>(std::lround(settings.rank_share * cells)), 1, cells);
      const double mean = orderedStatisticMean(cells, factor.rank);
      factor.noise_per_level = 1 / mean;
      factor.threshold_per_noise = orderedStatisticFactor(settings.false_alarm_rate, cells, factor.rank) * mean;
    }
  }
}

Cfar::Levels Cfar::levels(const RealGrid& power_db, double least_noise_db) const {
  const RealGrid power = (power_db.array() * (std::log(10.0) / 10)).exp();
  Levels levels;
  levels.noise_db = RealGrid::Constant(power.rows(), power.cols(), kNotANumber);
  levels.threshold_db = levels.noise_db;
  std::vector<double> training(offsets_.size());
  for (Eigen::Index r = 0; r < power.rows(); ++r) {
    for (Eigen::Index a = 0; a < power.cols(); ++a) {
      if (std::isnan(power(r, a))) continue;
      std::size_t cells = 0;
      for (const Offset& offset : offsets_) {
        const Eigen::Index i = r + offset.range_bins, j = a + offset.angle_bins;
        if (i < 0 || i >= power.rows() || j < 0 || j >= power.cols() || std::isnan(power(i, j))) continue;
        training[cells++] = power(i, j);
      }
      if (cells == 0) continue;
      const Factor& factor = factors_[cells];
      const auto begin = training.begin(), end = begin + static_cast<std::ptrdiff_t>(cells);
      double level;
      if (settings_.kind == CfarKind::kCellAveraging) {
        level = std::accumulate(begin, end, 0.0) / static_cast<double>(cells);
      } else {
        const auto ranked = begin + (factor.rank - 1);
        std::nth_element(begin, ranked, end);
        level = *ranked;
      }
      levels.noise_db(r, a) = std::max(decibels(level * factor.noise_per_level), least_noise_db);
      levels.threshold_db(r, a) = levels.noise_db(r, a) + decibels(factor.threshold_per_noise);
    }
  }
  return levels;
}

std::vector<Detection> Cfar::detect(const RangeAngleMap& map, double least_noise_db) const {
  const RealGrid& power_db = map.power_db;
  const Levels found = levels(power_db, least_noise_db);
  const std::vector<double> strongest_db = strongestByRange_db(power_db);
  std::vector<Detection> detections;
  for (Eigen::Index r = 0; r < power_db.rows(); ++r) {
    const double least_db = strongest_db[static_cast<std::size_t>(r)] - settings_.sidelobe_db;
    for (Eigen::Index a = 0; a < power_db.cols(); ++a) {
      // A masked cell has no threshold, and nothing is greater than that.
      if (!(power_db(r, a) > found.threshold_db(r, a)) || power_db(r, a) < least_db) continue;
      if (!isLocalMaximum(power_db, r, a, peak_angle_bins_)) continue;
      detections.push_back({static_cast<int>(r), static_cast<int>(a), map.axes.range_m[static_cast<std::size_t>(r)],
                            map.axes.azimuth_rad[static_cast<std::size_t>(a)], power_db(r, a),
                            power_db(r, a) - found.noise_db(r, a)});
    }
  }
  return detections;
}

double noiseFloor_db(const Cfar& cfar, const RealGrid& power_db) {
  const RealGrid noise_db = cfar.levels(power_db).noise_db;
  std::vector<double> known_db;
  for (Eigen::Index i = 0; i < noise_db.size(); ++i) {
    if (!std::isnan(noise_db.data()[i])) known_db.push_back(noise_db.data()[i]);
  }
  return quantile(std::move(known_db), kFloorShare);
}

}  // namespace mmradartwin
