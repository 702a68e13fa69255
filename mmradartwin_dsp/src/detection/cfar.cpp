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

RealGrid linear(const RealGrid& power_db) { return (power_db.array() * (std::log(10.0) / 10)).exp(); }

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
  beam_bins_ = std::max(1, (kAngleBins + length - 1) / length);
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
      if (std::abs(j) * beam_bins_ >= kAngleBins) continue;
      offsets_.push_back({i * kIndependentRange_bins, j * beam_bins_});
    }
  }
  factors_.resize(offsets_.size() + 1);
  for (int cells = 1; cells <= trainingCells(); ++cells) {
    Factor& factor = factors_[static_cast<std::size_t>(cells)];
    if (settings.kind == CfarKind::kCellAveraging) {
      factor.threshold_per_noise_db = decibels(cellAveragingFactor(settings.false_alarm_rate, cells));
    } else {
      factor.rank = std::clamp(static_cast<int>(std::lround(settings.rank_share * cells)), 1, cells);
      const double mean = orderedStatisticMean(cells, factor.rank);
      factor.noise_per_level_db = -decibels(mean);
      factor.threshold_per_noise_db =
          decibels(orderedStatisticFactor(settings.false_alarm_rate, cells, factor.rank) * mean);
      most_above_rank_ = std::max(most_above_rank_, cells - factor.rank);
    }
    const double threshold = std::pow(10, (factor.noise_per_level_db + factor.threshold_per_noise_db) / 10) /
                             (settings.kind == CfarKind::kCellAveraging ? cells : 1);
    least_threshold_ = cells == 1 ? threshold : std::min(least_threshold_, threshold);
  }
}

Cfar::Level Cfar::levelAt(const RealGrid& power, Eigen::Index range_bin, Eigen::Index angle_bin, double least_noise_db,
                          std::vector<double>& training) const {
  training.clear();
  for (const Offset& offset : offsets_) {
    const Eigen::Index i = range_bin + offset.range_bins, j = angle_bin + offset.angle_bins;
    if (i < 0 || i >= power.rows() || j < 0 || j >= power.cols() || std::isnan(power(i, j))) continue;
    training.push_back(power(i, j));
  }
  if (training.empty()) return {};
  const Factor& factor = factors_[training.size()];
  Level level;
  if (settings_.kind == CfarKind::kCellAveraging) {
    const double sum = std::accumulate(training.begin(), training.end(), 0.0);
    level.noise_db = decibels(sum / static_cast<double>(training.size()));
  } else {
    const auto ranked = training.begin() + (factor.rank - 1);
    std::nth_element(training.begin(), ranked, training.end());
    level.noise_db = decibels(*ranked);
  }
  level.noise_db = std::max(level.noise_db + factor.noise_per_level_db, least_noise_db);
  level.threshold_db = level.noise_db + factor.threshold_per_noise_db;
  return level;
}

bool Cfar::mayExceed(const RealGrid& power, Eigen::Index range_bin, Eigen::Index angle_bin) const {
  const double most = power(range_bin, angle_bin) / least_threshold_;
  const bool averages = settings_.kind == CfarKind::kCellAveraging;
  double sum = 0;
  int above = 0;
  for (const Offset& offset : offsets_) {
    const Eigen::Index i = range_bin + offset.range_bins, j = angle_bin + offset.angle_bins;
    if (i < 0 || i >= power.rows() || j < 0 || j >= power.cols() || std::isnan(power(i, j))) continue;
    sum += power(i, j);
    above += power(i, j) > most * (1 + 1e-9) ? 1 : 0;
    if (averages ? sum > most * (1 + 1e-9) : above > most_above_rank_) return false;
  }
  return true;
}

Cfar::Levels Cfar::levels(const RealGrid& power_db, double least_noise_db) const {
  const RealGrid power = linear(power_db);
  Levels levels;
  levels.noise_db = RealGrid::Constant(power_db.rows(), power_db.cols(), kNotANumber);
  levels.threshold_db = levels.noise_db;
  std::vector<double> training;
  for (Eigen::Index r = 0; r < power_db.rows(); ++r) {
    for (Eigen::Index a = 0; a < power_db.cols(); ++a) {
      if (std::isnan(power_db(r, a))) continue;
      const Level level = levelAt(power, r, a, least_noise_db, training);
      levels.noise_db(r, a) = level.noise_db;
      levels.threshold_db(r, a) = level.threshold_db;
    }
  }
  return levels;
}

std::vector<Detection> Cfar::detect(const RangeAngleMap& map, double least_noise_db) const {
  const RealGrid& power_db = map.power_db;
  const RealGrid power = linear(power_db);
  const std::vector<double> strongest_db = strongestByRange_db(power_db);
  const Eigen::Index half_beam_bins = std::max(1, beam_bins_ / 2);
  std::vector<Detection> detections;
  std::vector<double> training;
  for (Eigen::Index r = 0; r < power_db.rows(); ++r) {
    const double least_db = strongest_db[static_cast<std::size_t>(r)] - settings_.sidelobe_db;
    for (Eigen::Index a = 0; a < power_db.cols(); ++a) {
      // Few cells are left for the threshold, which takes longest. A masked cell is not at least anything.
      if (!(power_db(r, a) >= least_db) || !isLocalMaximum(power_db, r, a, half_beam_bins) || !mayExceed(power, r, a)) {
        continue;
      }
      const Level level = levelAt(power, r, a, least_noise_db, training);
      // Without training cells there is no threshold, and nothing is greater than that.
      if (!(power_db(r, a) > level.threshold_db)) continue;
      detections.push_back({static_cast<int>(r), static_cast<int>(a), map.axes.range_m[static_cast<std::size_t>(r)],
                            map.axes.azimuth_rad[static_cast<std::size_t>(a)], power_db(r, a),
                            power_db(r, a) - level.noise_db, kNotANumber});
    }
  }
  return detections;
}

double Cfar::noiseFloor_db(const RealGrid& power_db) const {
  const RealGrid power = linear(power_db);
  std::vector<double> known_db, training;
  for (Eigen::Index r = 0; r < power_db.rows(); r += kIndependentRange_bins) {
    for (Eigen::Index a = 0; a < power_db.cols(); a += beam_bins_) {
      if (std::isnan(power_db(r, a))) continue;
      const double noise_db = levelAt(power, r, a, -std::numeric_limits<double>::infinity(), training).noise_db;
      if (!std::isnan(noise_db)) known_db.push_back(noise_db);
    }
  }
  return quantile(std::move(known_db), kFloorShare);
}

}  // namespace mmradartwin
