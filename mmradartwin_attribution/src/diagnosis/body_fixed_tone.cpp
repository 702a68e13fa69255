#include "body_fixed_tone.h"

#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <vector>

#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin {
namespace {

constexpr int kBins = 4;        ///< leakage lies at some centimetres, its lobe reaches two bins further
constexpr double kTail = 4;     ///< degrees of freedom of the complex t, as in SessionModel
constexpr double kShare = 0.5;  ///< of a bin: neighbours overlap through the window
constexpr int kRounds = 6;      ///< of re-weighting

ComplexGrid unitTone(const RadarConfig& radar, double range_m) {
  ComplexGrid x(1, radar.samples_per_chirp);
  const double rate = 2 * M_PI * radar.slope_hz_per_s * 2 * range_m / kSpeedOfLight_m_per_s;
  for (int n = 0; n < radar.samples_per_chirp; ++n) {
    x(0, n) = std::polar(1.0, rate * (radar.sample_time_s(n) - radar.window_center_s()));
  }
  return x;
}

struct ToneFit {
  Eigen::VectorXcd channels;
  double log_likelihood = 0;
};

/// Vector over channels (zero where `with` is false) and scale of each bin, by expectation-maximisation of the t.
ToneFit fitTone(const ChannelData& data, const Eigen::VectorXcd& kernel, bool with) {
  const Eigen::Index channels = data.poses.front().y.rows();
  ToneFit fit{Eigen::VectorXcd::Zero(channels), 0};
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(kBins);
  for (int r = 0; r < kBins; ++r) {
    std::vector<double> power;
    for (const PoseChannels& p : data.poses) power.push_back(p.y.col(r).squaredNorm() / static_cast<double>(channels));
    std::nth_element(power.begin(), power.begin() + static_cast<std::ptrdiff_t>(power.size() / 2), power.end());
    scale[r] = std::max(power[power.size() / 2], 1e-30);
  }
  const double m = static_cast<double>(channels);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(channels);
    double total = 0;
    Eigen::VectorXd spread = Eigen::VectorXd::Zero(kBins);
    for (const PoseChannels& p : data.poses) {
      for (int r = 0; r < kBins; ++r) {
        const Eigen::VectorXcd e = p.y.col(r) - kernel[r] * fit.channels;
        const double w = (m + kTail) / (kTail + e.squaredNorm() / scale[r]);
        sum += w / scale[r] * std::conj(kernel[r]) * p.y.col(r);
        total += w / scale[r] * std::norm(kernel[r]);
        spread[r] += w * e.squaredNorm();
      }
    }
    for (int r = 0; r < kBins; ++r)
      scale[r] = std::max(spread[r] / (m * static_cast<double>(data.poses.size())), 1e-30);
    if (with) fit.channels = sum / total;
  }
  for (const PoseChannels& p : data.poses) {
    for (int r = 0; r < kBins; ++r) {
      const double q = (p.y.col(r) - kernel[r] * fit.channels).squaredNorm() / scale[r];
      fit.log_likelihood += kShare * (-m * std::log(scale[r]) - (m + kTail) * std::log1p(q / kTail));
    }
  }
  return fit;
}

}  // namespace

BodyFixedTone findBodyFixedTone(const ChannelData& data) {
  BodyFixedTone best;
  best.channels = Eigen::VectorXcd::Zero(data.radar.channels());
  if (data.poses.size() < 2 || data.radar.samples_per_chirp <= kBins) return best;
  const SignalChain chain(data.radar);
  const auto kernelAt = [&](double range_m) -> Eigen::VectorXcd {
    // The chain takes all channels; the tone is the same on each.
    const ComplexGrid x = unitTone(data.radar, range_m).replicate(data.radar.channels(), 1);
    return chain.rangeSpectra(x).row(0).head(kBins).transpose() / (0.5 * data.radar.samples_per_chirp);
  };
  const double without = fitTone(data, Eigen::VectorXcd::Zero(kBins), false).log_likelihood;
  const double step_m = 0.02 * data.radar.range_bin_m();
  std::vector<double> curve;
  for (double range_m = 0; range_m < 1.5 * data.radar.range_bin_m(); range_m += step_m) {
    const ToneFit fit = fitTone(data, kernelAt(range_m), true);
    curve.push_back(fit.log_likelihood);
    if (curve.size() > 1 && fit.log_likelihood - without <= best.gain) continue;
    best.gain = fit.log_likelihood - without;
    best.range_m = range_m;
    best.channels = fit.channels;
  }
  const std::size_t at = static_cast<std::size_t>(std::lround(best.range_m / step_m));
  if (at > 0 && at + 1 < curve.size()) {
    const double bend = (curve[at - 1] + curve[at + 1] - 2 * curve[at]) / (step_m * step_m);
    const double slope = (curve[at + 1] - curve[at - 1]) / (2 * step_m);
    if (bend < 0) {
      best.range_error_m = 1 / std::sqrt(-bend);
      best.range_m += std::clamp(-slope / bend, -step_m, step_m);
    }
  }
  const double numbers = 2.0 * data.radar.channels() + 1;
  const double others =
      std::max(1.0, 2.0 * kShare * data.radar.channels() * static_cast<double>(data.poses.size()) - numbers);
  const boost::math::fisher_f distribution(numbers, others);
  best.false_alarm_rate =
      boost::math::cdf(boost::math::complement(distribution, 2 * std::max(0.0, best.gain) / numbers));
  return best;
}

void subtractTone(const BodyFixedTone& tone, ChannelData& data) {
  const SignalChain chain(data.radar);
  const ComplexGrid unit = unitTone(data.radar, tone.range_m);
  for (PoseChannels& p : data.poses) {
    p.grid.x -= p.grid.full_scale * tone.channels * unit.row(0);
    transformGrid(chain, p);
  }
}

}  // namespace mmradartwin
