#include "diagnosis/search/transmitter_delay.h"

#include <cmath>
#include <complex>
#include <numeric>

namespace mmradartwin::diagnosis::search {
namespace {

constexpr double kLongestDelay_m = 2;     ///< longest delay that is looked for, one-way
constexpr double kDelayStep_bins = 0.25;  ///< of range, between delays that are looked at
constexpr int kRefinements = 6;           ///< halvings of the step about the best one
constexpr double kPhases_deg[] = {0, 90, 180, -90};

/// Windowed product of two transmitters' samples, summed over receivers, one pose.
Eigen::VectorXcd productOf(const ComplexGrid& x, int receivers, int slot) {
  Eigen::VectorXcd z = Eigen::VectorXcd::Zero(x.cols());
  for (int r = 0; r < receivers; ++r) {
    z += x.row(slot * receivers + r).cwiseProduct(x.row(r).conjugate()).transpose();
  }
  for (Eigen::Index n = 0; n < z.size(); ++n) {
    z[n] *= 0.5 - 0.5 * std::cos(2 * M_PI * static_cast<double>(n) / static_cast<double>(z.size()));
  }
  return z;
}

/// Sum over poses of the tone's power at a delay, each pose counting by its share of power there.
double powerAt(const std::vector<Eigen::VectorXcd>& products, double bins) {
  double sum = 0;
  for (const Eigen::VectorXcd& z : products) {
    std::complex<double> tone = 0;
    for (Eigen::Index n = 0; n < z.size(); ++n) {
      tone += z[n] * std::polar(1.0, -2 * M_PI * bins * static_cast<double>(n) / static_cast<double>(z.size()));
    }
    const double whole = z.squaredNorm();
    if (whole > 0) sum += std::norm(tone) / whole;
  }
  return sum;
}

}  // namespace

std::vector<double> transmitterDelays_m(const ChannelData& data) {
  const int receivers = data.radar.receivers();
  const double bin_m = data.radar.range_bin_m(), farthest = kLongestDelay_m / bin_m;
  std::vector<double> delays_m = {0};
  for (int slot = 1; slot < data.radar.slots(); ++slot) {
    std::vector<Eigen::VectorXcd> products;
    for (const PoseChannels& p : data.poses) products.push_back(productOf(p.grid.x, receivers, slot));
    double best = 0, power = powerAt(products, 0);
    const auto tryAt = [&](double bins) {
      const double there = powerAt(products, bins);
      if (!(there > power)) return;
      power = there;
      best = bins;
    };
    for (double bins = -farthest; bins <= farthest; bins += kDelayStep_bins) tryAt(bins);
    for (double step = kDelayStep_bins / 2; step > kDelayStep_bins / std::pow(2.0, kRefinements); step /= 2) {
      const double middle = best;
      tryAt(middle - step);
      tryAt(middle + step);
    }
    delays_m.push_back(best * bin_m);
  }
  return delays_m;
}

std::optional<Screened> delayed(const Hypothesis& hypothesis, const std::vector<double>& delays_m) {
  if (hypothesis.form() != MechanismForm::kTransmitterDelay) return std::nullopt;
  const double own_m = delays_m.at(static_cast<std::size_t>(hypothesis.mechanism.values.number("slot")));
  const double all_m = std::accumulate(delays_m.begin(), delays_m.end(), 0.0);
  const double delay_m = own_m - (all_m - own_m) / static_cast<double>(delays_m.size() - 1);
  Screened screened{hypothesis, 0, {}};
  for (double phase_deg : kPhases_deg) {
    std::vector<double> start;
    for (const Coordinate& c : hypothesis.coordinates) {
      start.push_back(c.scaled(c.neutral + (c.unit == "m" ? delay_m : phase_deg)));
    }
    screened.starts.push_back(std::move(start));
  }
  return screened;
}

}  // namespace mmradartwin::diagnosis::search
