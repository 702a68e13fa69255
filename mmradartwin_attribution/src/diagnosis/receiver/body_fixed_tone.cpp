#include "diagnosis/receiver/body_fixed_tone.h"

#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "diagnosis/receiver/channel_errors.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::receiver {
namespace {

// What skirts of echoes add to a tone's range error: leakages of the blind protocol's seeds 51 to 57 lay 0.2 to 0.5 mm
// off where their cells alone said 0.15 mm.
constexpr double kBesideEchoes_m = 0.00025;
constexpr double kReach_m = 0.15;     ///< where leakage lies at most (causes.md, A1)
constexpr double kReach_bins = 1.5;   ///< but so many bins at least
constexpr double kTail = 4;           ///< degrees of freedom of the complex t, as in ChannelLikelihood
constexpr double kShare = 0.5;        ///< of a bin: neighbours overlap through the window
constexpr int kRounds = 6;            ///< of re-weighting
constexpr double kEchoErrors = 0.03;  ///< of an echo's power, by errors of channels

ComplexGrid unitTone(const RadarConfig& radar, double range_m) {
  ComplexGrid x(1, radar.samples_per_chirp);
  const double rate = 2 * M_PI * radar.slope_hz_per_s * 2 * range_m / kSpeedOfLight_m_per_s;
  for (int n = 0; n < radar.samples_per_chirp; ++n) {
    x(0, n) = std::polar(1.0, rate * (radar.sample_time_s(n) - radar.window_center_s()));
  }
  return x;
}

/// The first bins of all poses, and the last ones before them where a tone may lie behind the radar.
class FirstBins {
 public:
  FirstBins(const ChannelData& data, bool behind) : data_(data), chain_(data.radar) {
    reach_m_ = std::max(kReach_m, kReach_bins * data.radar.range_bin_m());
    // The window's lobe reaches two bins further.
    const int last = std::max(4, static_cast<int>(std::ceil(reach_m_ / data.radar.range_bin_m())) + 2) - 1;
    const int samples = data.radar.samples_per_chirp;
    if (2 * last + 1 >= samples) return;
    for (int r = behind ? -last : 0; r <= last; ++r) bins_.push_back((r + samples) % samples);
    for (int bin : bins_) {
      Bin b{Eigen::MatrixXcd(channels(), static_cast<Eigen::Index>(poses())), {}};
      for (std::size_t p = 0; p < poses(); ++p) b.y.col(static_cast<Eigen::Index>(p)) = data.poses[p].y.col(bin);
      b.power = b.y.colwise().squaredNorm().transpose();
      of_bins_.push_back(std::move(b));
    }
  }
  /// One bin of all poses.
  struct Bin {
    Eigen::MatrixXcd y;     ///< [channels][poses]
    Eigen::VectorXd power;  ///< [poses], of all channels
    /// Power that a tone's channels, times its kernel there, leave. [poses]
    Eigen::VectorXd left(const std::complex<double>& kernel, const Eigen::VectorXcd& tone) const {
      const Eigen::VectorXcd seen = y.transpose() * (std::conj(kernel) * tone.conjugate());
      return ((power - 2 * seen.real()).array() + std::norm(kernel) * tone.squaredNorm()).max(0.0);
    }
  };
  const std::vector<int>& bins() const { return bins_; }
  double reach_m() const { return reach_m_; }
  Eigen::Index channels() const { return data_.poses.front().y.rows(); }
  std::size_t poses() const { return data_.poses.size(); }
  const Bin& of(std::size_t bin) const { return of_bins_[bin]; }

  /// What a tone of amplitude 1 gives in each bin.
  Eigen::VectorXcd kernel(double range_m) const {
    // The chain takes all channels; the tone is the same on each.
    const ComplexGrid x = unitTone(data_.radar, range_m).replicate(data_.radar.channels(), 1);
    const ComplexGrid spectra = chain_.rangeSpectra(x);
    Eigen::VectorXcd kernel(static_cast<Eigen::Index>(bins_.size()));
    for (std::size_t i = 0; i < bins_.size(); ++i) kernel[static_cast<Eigen::Index>(i)] = spectra(0, bins_[i]);
    return kernel / (0.5 * data_.radar.samples_per_chirp);
  }

 private:
  const ChannelData& data_;
  SignalChain chain_;
  double reach_m_ = 0;
  std::vector<int> bins_;
  std::vector<Bin> of_bins_;
};

struct ToneFit {
  Eigen::VectorXcd channels;
  double log_likelihood = 0;
};

/// Vector over channels (zero where `with` is false) and scale of each bin, by expectation-maximisation of the t.
ToneFit fitTone(const FirstBins& data, const Eigen::VectorXcd& kernel, bool with) {
  const std::size_t bins = data.bins().size();
  const double poses = static_cast<double>(data.poses()), m = static_cast<double>(data.channels());
  ToneFit fit{Eigen::VectorXcd::Zero(data.channels()), 0};
  Eigen::VectorXd scale(static_cast<Eigen::Index>(bins));
  for (std::size_t r = 0; r < bins; ++r) {
    Eigen::VectorXd power = data.of(r).power / m;
    std::nth_element(power.begin(), power.begin() + power.size() / 2, power.end());
    scale[static_cast<Eigen::Index>(r)] = std::max(power[power.size() / 2], 1e-30);
  }
  for (int round = 0; round < kRounds; ++round) {
    Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(data.channels());
    double total = 0;
    for (std::size_t r = 0; r < bins; ++r) {
      const auto i = static_cast<Eigen::Index>(r);
      const Eigen::VectorXd left = data.of(r).left(kernel[i], fit.channels);
      const Eigen::VectorXd w = ((m + kTail) / (kTail + left.array() / scale[i])).matrix();
      sum += std::conj(kernel[i]) / scale[i] * (data.of(r).y * w);
      total += w.sum() / scale[i] * std::norm(kernel[i]);
      scale[i] = std::max(w.dot(left) / (m * poses), 1e-30);
    }
    if (with) fit.channels = sum / total;
  }
  for (std::size_t r = 0; r < bins; ++r) {
    const auto i = static_cast<Eigen::Index>(r);
    const Eigen::ArrayXd off = data.of(r).left(kernel[i], fit.channels).array() / (scale[i] * kTail);
    fit.log_likelihood += kShare * (-m * poses * std::log(scale[i]) - (m + kTail) * off.log1p().sum());
  }
  return fit;
}

/// The same of the only pose, where a bin's scale cannot be told from what stands in it: least squares over all bins.
ToneFit fitOnlyPose(const FirstBins& data, const Eigen::VectorXcd& kernel) {
  ToneFit fit{Eigen::VectorXcd::Zero(data.channels()), 0};
  double all = 0;
  for (std::size_t r = 0; r < data.bins().size(); ++r) {
    fit.channels += std::conj(kernel[static_cast<Eigen::Index>(r)]) * data.of(r).y.col(0);
    all += data.of(r).power[0];
  }
  const double norm = kernel.squaredNorm();
  fit.channels /= norm;
  const double cells = static_cast<double>(data.channels()) * static_cast<double>(data.bins().size());
  fit.log_likelihood = -kShare * cells * std::log(std::max(1e-9 * all, all - norm * fit.channels.squaredNorm()));
  return fit;
}

}  // namespace

BodyFixedTone findBodyFixedTone(const ChannelData& data, bool behind) {
  BodyFixedTone best;
  best.channels = Eigen::VectorXcd::Zero(data.radar.channels());
  const FirstBins first(data, behind);
  if (first.bins().empty()) return best;
  const bool only = data.poses.size() == 1;
  const double step_m = 0.02 * data.radar.range_bin_m();
  const int steps = static_cast<int>(first.reach_m() / step_m);
  std::vector<double> curve;
  double highest = -std::numeric_limits<double>::infinity();
  int at = 0;
  for (int i = behind ? -steps : 0; i <= steps; ++i) {
    const ToneFit fit =
        only ? fitOnlyPose(first, first.kernel(i * step_m)) : fitTone(first, first.kernel(i * step_m), true);
    curve.push_back(fit.log_likelihood);
    if (fit.log_likelihood <= highest) continue;
    highest = fit.log_likelihood;
    at = static_cast<int>(curve.size()) - 1;
    best.range_m = i * step_m;
    best.channels = fit.channels;
  }
  best.array_share = arrayShare(data.radar, best.channels);
  const Eigen::VectorXcd kernel = first.kernel(best.range_m);
  if (only) {
    // Channels are off by some 10 degrees and 1 dB: so much of an echo's power is no array response, and not more.
    const double beyond = (1 - best.array_share) / kEchoErrors;
    double all = 0, strongest = 0;
    for (std::size_t r = 0; r < first.bins().size(); ++r) all += first.of(r).power[0];
    for (Eigen::Index r = 0; r < data.poses[0].y.cols(); ++r) {
      strongest = std::max(strongest, data.poses[0].y.col(r).squaredNorm());
    }
    const double own = best.channels.squaredNorm();
    const double noise = static_cast<double>(data.radar.channels()) * data.poses[0].noise_power;
    if (beyond <= 1 || kernel.squaredNorm() * own < 0.5 * all || own < 100 * noise || own < 0.01 * strongest) {
      return best;
    }
    best.gain = (static_cast<double>(data.radar.channels()) - 2) * (beyond - 1 - std::log(beyond));
    best.false_alarm_rate = std::exp(-best.gain);
  } else {
    best.gain = highest - fitTone(first, Eigen::VectorXcd::Zero(kernel.size()), false).log_likelihood;
  }
  if (behind) {
    // A constant lies at no range; within a quarter of a bin of that it is neither before nor behind.
    const auto split = curve.begin() + std::max(1, steps - 12);
    best.behind = *std::max_element(curve.begin(), split) - *std::max_element(split, curve.end());
  }
  if (at > 0 && at + 1 < static_cast<int>(curve.size())) {
    const double before = curve[static_cast<std::size_t>(at) - 1], after = curve[static_cast<std::size_t>(at) + 1];
    const double curvature = (before + after - 2 * highest) / (step_m * step_m);
    const double slope = (after - before) / (2 * step_m);
    if (curvature < 0) {
      best.range_error_m = std::hypot(1 / std::sqrt(-curvature), kBesideEchoes_m);
      best.range_m += std::clamp(-slope / curvature, -step_m, step_m);
    }
  }
  if (only) return best;
  const double numbers = 2.0 * data.radar.channels() + 1;
  const double others =
      std::max(1.0, 2.0 * kShare * data.radar.channels() * static_cast<double>(data.poses.size()) - numbers);
  const boost::math::fisher_f distribution(numbers, others);
  best.false_alarm_rate =
      boost::math::cdf(boost::math::complement(distribution, 2 * std::max(0.0, best.gain) / numbers));
  return best;
}

bool isPlain(const BodyFixedTone& tone) { return tone.false_alarm_rate <= 1e-6 && tone.gain >= 30; }

void subtractTone(const BodyFixedTone& tone, ChannelData& data) {
  const SignalChain chain(data.radar);
  const ComplexGrid unit = unitTone(data.radar, tone.range_m);
  for (PoseChannels& p : data.poses) {
    p.grid.x -= p.grid.full_scale * tone.channels * unit.row(0);
    transformGrid(chain, p);
  }
}

}  // namespace mmradartwin::diagnosis::receiver
