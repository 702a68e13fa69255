#include "diagnosis/receiver/body_fixed_tone.h"

#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/receiver/channel_errors.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::receiver {
namespace {

constexpr double kReach_m = 0.15;    ///< largest range of leakage (docs/reference/causes.md, A1)
constexpr double kReach_bins = 1.5;  ///< range that is searched at least
constexpr double kStep_bins = 0.02;  ///< between ranges that are tried
/// Steps about range 0 (a quarter of a bin) that count neither as before nor as behind the radar.
constexpr int kNeither = 12;
constexpr double kTail = 4;            ///< degrees of freedom of the complex t, as in ChannelLikelihood
constexpr double kShare = 0.5;         ///< weight of a bin: neighbours overlap through the window
constexpr int kWeightRounds = 6;       ///< iterations of the weights
constexpr double kLeastScale = 1e-30;  ///< floor of a bin's scale, against division by zero

/// Samples [1][N] of a tone of amplitude 1 at a range, with phase 0 at the window's centre.
ComplexGrid unitTone(const RadarConfig& radar, double range_m) {
  ComplexGrid x(1, radar.samples_per_chirp);
  const double rate = 2 * M_PI * radar.slope_hz_per_s * 2 * range_m / kSpeedOfLight_m_per_s;
  for (int n = 0; n < radar.samples_per_chirp; ++n) {
    x(0, n) = std::polar(1.0, rate * (radar.sample_time_s(n) - radar.window_center_s()));
  }
  return x;
}

/// First range bins of all poses, and the last ones, where a tone behind the radar appears.
class FirstBins {
 public:
  FirstBins(const ChannelData& data, bool behind) : data_(data), chain_(data.radar) {
    reach_m_ = std::max(kReach_m, kReach_bins * data.radar.range_bin_m());
    // The window's main lobe reaches two bins further.
    const int last = std::max(4, static_cast<int>(std::ceil(reach_m_ / data.radar.range_bin_m())) + 2) - 1;
    const int samples = data.radar.samples_per_chirp;
    if (2 * last + 1 >= samples) return;
    for (int r = behind ? -last : 0; r <= last; ++r) bins_.push_back((r + samples) % samples);
    for (int bin : bins_) {
      Bin b{Eigen::MatrixXcd(channels(), static_cast<Eigen::Index>(poses())), {}};
      for (std::size_t p = 0; p < poses(); ++p)
        b.y.col(static_cast<Eigen::Index>(p)) = data.poses[p].range_spectra.col(bin);
      b.power = b.y.colwise().squaredNorm().transpose();
      values_.push_back(std::move(b));
    }
  }
  /// Data of one bin at all poses.
  struct Bin {
    Eigen::MatrixXcd y;     ///< [channels][poses]
    Eigen::VectorXd power;  ///< [poses], summed over channels
    /// Power [poses] without a tone of these channels, whose value in this bin is the kernel.
    Eigen::VectorXd left(const std::complex<double>& kernel, const Eigen::VectorXcd& tone) const {
      const Eigen::VectorXcd seen = y.transpose() * (std::conj(kernel) * tone.conjugate());
      return ((power - 2 * seen.real()).array() + std::norm(kernel) * tone.squaredNorm()).max(0.0);
    }
  };
  const std::vector<int>& bins() const { return bins_; }
  double reach_m() const { return reach_m_; }
  Eigen::Index channels() const { return data_.poses.front().range_spectra.rows(); }
  std::size_t poses() const { return data_.poses.size(); }
  const Bin& of(std::size_t bin) const { return values_[bin]; }

  /// Values of a tone of amplitude 1 in each bin.
  Eigen::VectorXcd kernel(double range_m) const {
    // The chain takes all channels, which are alike here.
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
  std::vector<Bin> values_;  ///< in the order of bins_
};

/// Tone at a range with its likelihood.
struct ToneFit {
  Eigen::VectorXcd channels;
  double log_likelihood = 0;
};

/// Fits the channels of a tone (none where `with` is false) and the scale of each bin, by expectation maximisation of
/// the complex t.
ToneFit fitTone(const FirstBins& data, const Eigen::VectorXcd& kernel, bool with) {
  const std::size_t bins = data.bins().size();
  const double poses = static_cast<double>(data.poses()), m = static_cast<double>(data.channels());
  ToneFit fit{Eigen::VectorXcd::Zero(data.channels()), 0};
  Eigen::VectorXd scale(static_cast<Eigen::Index>(bins));
  for (std::size_t r = 0; r < bins; ++r) {
    Eigen::VectorXd power = data.of(r).power / m;
    std::nth_element(power.begin(), power.begin() + power.size() / 2, power.end());
    scale[static_cast<Eigen::Index>(r)] = std::max(power[power.size() / 2], kLeastScale);
  }
  for (int round = 0; round < kWeightRounds; ++round) {
    Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(data.channels());
    double total = 0;
    for (std::size_t r = 0; r < bins; ++r) {
      const auto i = static_cast<Eigen::Index>(r);
      const Eigen::VectorXd left = data.of(r).left(kernel[i], fit.channels);
      const Eigen::VectorXd w = ((m + kTail) / (kTail + left.array() / scale[i])).matrix();
      sum += std::conj(kernel[i]) / scale[i] * (data.of(r).y * w);
      total += w.sum() / scale[i] * std::norm(kernel[i]);
      scale[i] = std::max(w.dot(left) / (m * poses), kLeastScale);
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

/// Fits a tone at the only pose by least squares over all bins: one pose does not separate a bin's scale from a tone in
/// it.
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

namespace {

/// Likelihood of the best tone at each range that is tried.
struct ToneCurve {
  double step_m = 0;
  int steps = 0;  ///< to either side of the radar
  std::vector<double> log_likelihood;
  int highest = 0;  ///< index of the most likely range
  double most = -std::numeric_limits<double>::infinity();
};

ToneCurve tryRanges(const FirstBins& first, const ChannelData& data, bool behind, BodyFixedTone& best) {
  ToneCurve curve;
  curve.step_m = kStep_bins * data.radar.range_bin_m();
  curve.steps = static_cast<int>(first.reach_m() / curve.step_m);
  for (int i = behind ? -curve.steps : 0; i <= curve.steps; ++i) {
    const Eigen::VectorXcd kernel = first.kernel(i * curve.step_m);
    const ToneFit fit = data.poses.size() == 1 ? fitOnlyPose(first, kernel) : fitTone(first, kernel, true);
    curve.log_likelihood.push_back(fit.log_likelihood);
    if (fit.log_likelihood <= curve.most) continue;
    curve.most = fit.log_likelihood;
    curve.highest = static_cast<int>(curve.log_likelihood.size()) - 1;
    best.range_m = i * curve.step_m;
    best.channels = fit.channels;
  }
  return curve;
}

/// Judges the tone of the only pose by the share of its power that no array response explains. False where the tone is
/// too weak.
bool judgeOnlyPose(const FirstBins& first, const ChannelData& data, const Eigen::VectorXcd& kernel,
                   BodyFixedTone& best) {
  const double beyond = (1 - best.array_share) / bounds::kEchoErrorShare;
  double all = 0, strongest = 0;
  for (std::size_t r = 0; r < first.bins().size(); ++r) all += first.of(r).power[0];
  for (Eigen::Index r = 0; r < data.poses[0].range_spectra.cols(); ++r) {
    strongest = std::max(strongest, data.poses[0].range_spectra.col(r).squaredNorm());
  }
  const double own = best.channels.squaredNorm();
  const double noise = static_cast<double>(data.radar.channels()) * data.poses[0].noise_power;
  if (beyond <= 1 || kernel.squaredNorm() * own < bounds::kLeastToneShare * all ||
      own < bounds::kLeastToneOverNoise * noise || own < bounds::kLeastToneOfStrongest * strongest) {
    return false;
  }
  best.gain = (static_cast<double>(data.radar.channels()) - 2) * (beyond - 1 - std::log(beyond));
  best.false_alarm_rate = std::exp(-best.gain);
  return true;
}

/// Sets the range and its standard error by a parabola through the likelihood's peak.
void refineRange(const ToneCurve& curve, BodyFixedTone& best) {
  if (curve.highest == 0 || curve.highest + 1 >= static_cast<int>(curve.log_likelihood.size())) return;
  const double before = curve.log_likelihood[static_cast<std::size_t>(curve.highest) - 1];
  const double after = curve.log_likelihood[static_cast<std::size_t>(curve.highest) + 1];
  const double curvature = (before + after - 2 * curve.most) / (curve.step_m * curve.step_m);
  const double slope = (after - before) / (2 * curve.step_m);
  if (curvature < 0) {
    best.range_error_m = std::hypot(1 / std::sqrt(-curvature), bounds::kToneRangeError_m);
    best.range_m += std::clamp(-slope / curvature, -curve.step_m, curve.step_m);
  }
}

/// Probability of so large a gain by chance (F distribution).
double falseAlarmRate(const ChannelData& data, double gain) {
  const double numbers = 2.0 * data.radar.channels() + 1;
  const double others =
      std::max(1.0, 2.0 * kShare * data.radar.channels() * static_cast<double>(data.poses.size()) - numbers);
  const boost::math::fisher_f distribution(numbers, others);
  return boost::math::cdf(boost::math::complement(distribution, 2 * std::max(0.0, gain) / numbers));
}

}  // namespace

BodyFixedTone findBodyFixedTone(const ChannelData& data, bool behind) {
  BodyFixedTone best;
  best.channels = Eigen::VectorXcd::Zero(data.radar.channels());
  const FirstBins first(data, behind);
  if (first.bins().empty()) return best;
  const bool only = data.poses.size() == 1;
  const ToneCurve curve = tryRanges(first, data, behind, best);
  best.array_share = arrayShare(data.radar, best.channels);
  const Eigen::VectorXcd kernel = first.kernel(best.range_m);
  if (only) {
    if (!judgeOnlyPose(first, data, kernel, best)) return best;
  } else {
    best.gain = curve.most - fitTone(first, Eigen::VectorXcd::Zero(kernel.size()), false).log_likelihood;
  }
  if (behind) {
    // A constant has no range: within a quarter of a bin a tone is neither before nor behind the radar.
    const auto& values = curve.log_likelihood;
    const auto split = values.begin() + std::max(1, curve.steps - kNeither);
    best.behind = *std::max_element(values.begin(), split) - *std::max_element(split, values.end());
  }
  refineRange(curve, best);
  if (!only) best.false_alarm_rate = falseAlarmRate(data, best.gain);
  return best;
}

bool isUnambiguous(const BodyFixedTone& tone) {
  return tone.false_alarm_rate <= bounds::kToneFalseAlarmRate && tone.gain >= bounds::kLeastNatsOfTone;
}

void subtractTone(const BodyFixedTone& tone, ChannelData& data) {
  const SignalChain chain(data.radar);
  const ComplexGrid unit = unitTone(data.radar, tone.range_m);
  for (PoseChannels& p : data.poses) {
    p.grid.x -= p.grid.full_scale * tone.channels * unit.row(0);
    transformGrid(chain, p);
  }
}

}  // namespace mmradartwin::diagnosis::receiver
