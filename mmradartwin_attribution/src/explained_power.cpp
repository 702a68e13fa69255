#include "mmradartwin_attribution/explained_power.h"

#include <cmath>
#include <complex>
#include <limits>

namespace mmradartwin {
namespace {

/// Bins to either side of a path's own in which its power counts: beyond, the window's transform lies below -90 dB.
constexpr int kReach_bins = 12;

double powerOf(double level_db) { return std::pow(10.0, level_db / 10); }

}  // namespace

void ExplainedPower::add(const ExplainedPower& other) {
  measured += other.measured;
  expected += other.expected;
  cross += other.cross;
}

double ExplainedPower::amplitudeGain() const { return expected > 0 ? cross / expected : 0; }

double ExplainedPower::share(double amplitude_gain) const {
  if (!(measured > 0)) return std::numeric_limits<double>::quiet_NaN();
  return (2 * amplitude_gain * cross - amplitude_gain * amplitude_gain * expected) / measured;
}

RealGrid expectedPower(const EvaluationField& field, const RadarConfig& radar, const std::vector<PathRecord>& records) {
  const RangeAngleAxes& axes = field.axes();
  const auto bins = static_cast<Eigen::Index>(axes.range_m.size());
  const VirtualLine line = radar.virtualLine();
  const auto elements = static_cast<Eigen::Index>(line.channels.size());
  const double wave = 2 * M_PI * line.pitch_m / radar.wavelength_m();
  Eigen::MatrixXcd steering(kAngleBins, elements);
  for (int a = 0; a < kAngleBins; ++a) {
    const double sine = std::sin(axes.azimuth_rad[static_cast<std::size_t>(a)]);
    for (Eigen::Index k = 0; k < elements; ++k) {
      steering(a, k) = std::polar(1.0 / static_cast<double>(elements), wave * line.places[k] * sine);
    }
  }
  const double bin_m = axes.range_m.size() > 1 ? axes.range_m[1] - axes.range_m[0] : 1;
  RealGrid power = RealGrid::Zero(bins, kAngleBins);
  Eigen::VectorXcd contribution(elements);
  for (const PathRecord& record : records) {
    if (record.c.empty()) continue;
    double length_m = 0;
    for (Eigen::Index k = 0; k < elements; ++k) {
      const auto channel = static_cast<std::size_t>(line.channels[static_cast<std::size_t>(k)]);
      contribution[k] = record.c[channel];
      length_m += record.length_m[channel] / static_cast<double>(elements);
    }
    const Eigen::RowVectorXd beams = (steering * contribution).array().abs2().matrix().transpose();
    const double at = length_m / 2 / bin_m;
    const auto middle = static_cast<Eigen::Index>(std::lround(at));
    for (Eigen::Index r = middle - kReach_bins; r <= middle + kReach_bins; ++r) {
      // Echoes from beyond the last bin stand in the first ones.
      power.row((r % bins + bins) % bins) += field.pointResponse(static_cast<double>(r) - at, 0) * beams;
    }
  }
  return power;
}

ExplainedPower explainedPower(const EvaluationField& field, const RangeAngleMap& measured,
                              const RangeAngleMap& simulated, const RealGrid& expected) {
  ExplainedPower sums;
  for (int r = 0; r < measured.power_db.rows(); ++r) {
    for (int a = 0; a < measured.power_db.cols(); ++a) {
      if (field.field(r, a) != Field::kCentral || std::isnan(measured.power_db(r, a))) continue;
      const double of_measured = powerOf(measured.power_db(r, a));
      const double of_expected = expected.size() > 0 ? expected(r, a) : powerOf(simulated.power_db(r, a));
      sums.measured += of_measured;
      sums.expected += of_expected;
      sums.cross += std::sqrt(of_measured * of_expected);
    }
  }
  return sums;
}

}  // namespace mmradartwin
