#include "diagnosis/frames/frame_stack.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin::diagnosis::frames {
namespace {

using Complex = std::complex<float>;

constexpr int kNeighbourCodes = 16;  ///< codes next to the outermost one that show how often it should occur
constexpr int kEchoesInBand = 8;     ///< a moving body with its limbs fills at most an eighth of the range bins
constexpr double kComplexRounding = 2 * kRoundingVariance;  ///< of I and of Q

float medianOf(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2) return *middle;
  return 0.5f * (*middle + *std::max_element(values.begin(), middle));
}

/// Weight of one value where the same sample of all shots counts as one.
double frameShare(const FrameStack& s) { return s.shots() > 0 ? 1.0 / s.shots() : 0; }

/// Counts at one end of a histogram, whose element i counts code i - 32768. share: weight of one value.
RailCounts countRail(const std::vector<int>& histogram, bool high, double share) {
  RailCounts counts;
  const int codes = static_cast<int>(histogram.size());
  int edge = high ? codes - 1 : 0, far = high ? 0 : codes - 1;
  const int step = high ? -1 : 1;
  while (edge != far && histogram[static_cast<std::size_t>(edge)] == 0) edge += step;
  while (far != edge && histogram[static_cast<std::size_t>(far)] == 0) far -= step;
  counts.code = edge - 32768;
  counts.at_code = histogram[static_cast<std::size_t>(edge)] * share;
  const int inside = std::min(kNeighbourCodes, std::abs(edge - far));
  double sum = 0;
  for (int i = 1; i <= inside; ++i) sum += histogram[static_cast<std::size_t>(edge + i * step)];
  counts.next_codes =
      std::abs(edge - far) < bounds::kLeastCodes ? std::numeric_limits<double>::infinity() : sum * share / inside;
  return counts;
}

}  // namespace

FrameStack::FrameStack(const RadarConfig& radar, const Payload& payload, const std::vector<int>& order)
    : frames(payload.frames),
      loops(radar.loops_per_frame),
      slots(radar.slots()),
      receivers(radar.receivers()),
      samples(radar.samples_per_chirp) {
  x.assign(static_cast<std::size_t>(shots()) * values(), 0);
  use.assign(x.size(), 1);
  // From [chirp][sample][rx][I, Q] with chirp = loop * slots + slot.
  std::vector<std::size_t> place(order.size(), 0);
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (order[i] < 0) continue;
    const int pair = order[i] / 2, rx = pair % receivers, n = pair / receivers % samples,
              chirp = pair / receivers / samples;
    place[i] = at(chirp / slots, chirp % slots * receivers + rx, n);
  }
  const std::size_t per_frame = static_cast<std::size_t>(loops) * values();
  for (int f = 0; f < frames; ++f) {
    const std::size_t base = static_cast<std::size_t>(f) * per_frame;
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (order[i] < 0) continue;
      const std::size_t from = payload.at(f, i);
      float* value = reinterpret_cast<float*>(&x[base + place[i]]);
      value[order[i] % 2] = payload.value[from];
      if (!payload.use[from]) use[base + place[i]] = 0;
    }
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!use[i]) x[i] = 0;
  }
}

Rails countRails(const FrameStack& stack) {
  Rails rails;
  std::vector<int> histogram(65536, 0);
  long long count = 0;
  for (std::size_t i = 0; i < stack.x.size(); ++i) {
    if (!stack.use[i]) continue;
    ++histogram[static_cast<std::size_t>(static_cast<int>(stack.x[i].real()) + 32768)];
    ++histogram[static_cast<std::size_t>(static_cast<int>(stack.x[i].imag()) + 32768)];
    count += 2;
  }
  if (count == 0) return rails;
  rails.samples = static_cast<double>(count) * frameShare(stack);
  rails.high = countRail(histogram, true, frameShare(stack));
  rails.low = countRail(histogram, false, frameShare(stack));
  return rails;
}

double pileUp(const RailCounts& counts) {
  // The density of a sine's values rises towards its ends as 1/sqrt(A^2 - v^2): the outermost code holds 1 + sqrt(2)
  // times what the next one holds. Half a sample is added, since missing neighbours prove nothing.
  const double expected = (1 + std::sqrt(2.0)) * counts.next_codes + 0.5;
  if (!(counts.at_code > expected)) return 0;
  return counts.at_code * std::log(counts.at_code / expected) - (counts.at_code - expected);
}

ClippedValues clippedValues(const Rails& rails, const FrameStack& stack) {
  ClippedValues clipped;
  const bool high = pileUp(rails.high) > 0, low = pileUp(rails.low) > 0;
  if (!high && !low) return clipped;
  const float infinity = std::numeric_limits<float>::infinity();
  const float top = high ? static_cast<float>(rails.high.code) : infinity;
  const float bottom = low ? static_cast<float>(rails.low.code) : -infinity;
  clipped.limit = std::min(top, -bottom);
  for (std::size_t i = 0; i < stack.x.size(); ++i) {
    if (!stack.use[i]) continue;
    const auto beyond = [&](float v) { return v >= top || v <= bottom; };
    const int count = beyond(stack.x[i].real()) + beyond(stack.x[i].imag());
    if (count) clipped.at.emplace_back(i, static_cast<std::uint8_t>(count));
  }
  return clipped;
}

std::map<std::size_t, Complex> clippedMeans(const ClippedValues& clipped, const FrameStack& s) {
  std::map<std::size_t, std::pair<std::complex<double>, int>> sums;
  for (const auto& [at, count] : clipped.at) {
    auto& [sum, times] = sums[at % s.values()];
    sum += std::complex<double>(s.x[at]);
    ++times;
  }
  std::map<std::size_t, Complex> means;
  for (const auto& [place, sum] : sums) means[place] = Complex(sum.first / static_cast<double>(sum.second));
  return means;
}

void dropStandingClipped(const ClippedValues& clipped, const std::vector<Complex>& average, FrameStack& s) {
  for (const auto& [at, count] : clipped.at) {
    // A value that clips occasionally has an average below the limit.
    if (std::abs(average[at % s.values()]) < 0.8 * clipped.limit) continue;
    s.x[at] = 0;
    s.use[at] = 0;
  }
}

ClippedCount countClipped(const ClippedValues& clipped, const Bursts& bursts, FrameStack& stack) {
  const auto chirp = [&](std::size_t at) {
    const std::size_t shot = at / stack.values(),
                      channel = at % stack.values() / static_cast<std::size_t>(stack.samples);
    return shot * static_cast<std::size_t>(stack.slots) + channel / static_cast<std::size_t>(stack.receivers);
  };
  double values = 0, used = 0;
  for (std::size_t i = 0; i < stack.use.size(); ++i) used += 2 * stack.use[i];
  for (const auto& [at, count] : clipped.at) {
    if (bursts.hit[chirp(at)]) continue;
    values += count;
    if (!stack.use[at]) used += 2;
    stack.x[at] = 0;
    stack.use[at] = 0;
  }
  return {values * frameShare(stack), used * frameShare(stack)};
}

std::vector<Complex> medianShot(const FrameStack& stack) {
  std::vector<Complex> average(stack.values());
  std::vector<float> re, im;
  const std::size_t values = stack.values();
  for (std::size_t i = 0; i < values; ++i) {
    re.clear();
    im.clear();
    for (std::size_t at = i; at < stack.x.size(); at += values) {
      if (!stack.use[at]) continue;
      re.push_back(stack.x[at].real());
      im.push_back(stack.x[at].imag());
    }
    if (!re.empty()) average[i] = {medianOf(re), medianOf(im)};
  }
  return average;
}

std::vector<Complex> meanShot(const FrameStack& stack) {
  const std::size_t values = stack.values();
  std::vector<std::complex<double>> sum(values, 0);
  std::vector<int> count(values, 0);
  for (int shot = 0; shot < stack.shots(); ++shot) {
    const std::size_t base = static_cast<std::size_t>(shot) * values;
    for (std::size_t i = 0; i < values; ++i) {
      if (!stack.use[base + i]) continue;
      sum[i] += std::complex<double>(stack.x[base + i]);
      ++count[i];
    }
  }
  std::vector<Complex> average(values);
  for (std::size_t i = 0; i < values; ++i) {
    if (count[i]) average[i] = Complex(sum[i] / static_cast<double>(count[i]));
  }
  return average;
}

std::vector<Complex> commonGains(const FrameStack& stack, const std::vector<Complex>& average, double noise_variance) {
  std::vector<Complex> gains(static_cast<std::size_t>(stack.shots()), 1);
  for (int shot = 0; shot < stack.shots(); ++shot) {
    std::complex<double> with = 0;
    double power = 0;
    const std::size_t base = static_cast<std::size_t>(shot) * stack.values();
    for (std::size_t i = 0; i < stack.values(); ++i) {
      if (!stack.use[base + i]) continue;
      with += std::complex<double>(std::conj(average[i]) * stack.x[base + i]);
      power += std::norm(average[i]);
    }
    // The average itself has 1/shots of the noise. It is a signal from ten times that on.
    if (power > 10 * noise_variance * static_cast<double>(stack.values()) / stack.shots()) {
      gains[static_cast<std::size_t>(shot)] = Complex(with / power);
    }
  }
  return gains;
}

double differenceVariance(const FrameStack& stack) {
  Eigen::FFT<float> fft(Eigen::FFT<float>::impl_type(), Eigen::FFT<float>::Unscaled);
  const std::vector<double> window = hannWindow(stack.samples);
  std::vector<Complex> difference(static_cast<std::size_t>(stack.samples)), spectrum(difference);
  std::vector<float> power(difference.size()), variances;
  for (int shot = 1; shot < stack.shots(); ++shot) {
    for (int k = 0; k < stack.channels(); ++k) {
      double window_power = 0;
      int count = 0;
      for (int n = 0; n < stack.samples; ++n) {
        const std::size_t now = stack.at(shot, k, n), before = stack.at(shot - 1, k, n),
                          i = static_cast<std::size_t>(n);
        const bool used = stack.use[now] && stack.use[before];
        difference[i] = used ? static_cast<float>(window[i]) * (stack.x[now] - stack.x[before]) : Complex(0);
        if (!used) continue;
        window_power += window[i] * window[i];
        ++count;
      }
      if (2 * count < stack.samples) continue;
      fft.fwd(spectrum.data(), difference.data(), stack.samples);
      std::transform(spectrum.begin(), spectrum.end(), power.begin(), [](const Complex& v) { return std::norm(v); });
      // The median of an exponential is ln 2 times its mean, and two shots differ by twice the noise of one.
      variances.push_back(medianOf(power) / static_cast<float>(2 * std::log(2.0) * window_power));
    }
  }
  return variances.empty() ? kComplexRounding : std::max<double>(medianOf(variances), kComplexRounding);
}

void turnFrames(double rad_per_frame, FrameStack& s) {
  const std::size_t per_frame = static_cast<std::size_t>(s.loops) * s.values();
  for (int f = 1; f < s.frames; ++f) {
    const auto turn = Complex(std::polar(1.0, rad_per_frame * f));
    for (std::size_t i = 0; i < per_frame; ++i) s.x[static_cast<std::size_t>(f) * per_frame + i] *= turn;
  }
}

namespace {

/// True where most of a power by range bin lies in two groups of neighbouring bins.
bool isOfEchoes(std::vector<float> power) {
  const std::size_t bins = power.size(), wide = std::max<std::size_t>(1, bins / kEchoesInBand);
  double left = std::accumulate(power.begin(), power.end(), 0.0);
  const double all = left;
  for (int echo = 0; echo < 2; ++echo) {
    double most = 0;
    std::size_t first = 0;
    for (std::size_t from = 0; from + wide <= bins; ++from) {
      const auto begin = power.begin() + static_cast<std::ptrdiff_t>(from);
      const double here = std::accumulate(begin, begin + static_cast<std::ptrdiff_t>(wide), 0.0);
      if (here <= most) continue;
      most = here;
      first = from;
    }
    std::fill_n(power.begin() + static_cast<std::ptrdiff_t>(first), wide, 0.0f);
    left -= most;
  }
  return left < (1 - bounds::kLeastShareOfMovers) * all;
}

/// Differences of one chirp from the average times the shot's gain, at all receivers.
class ChirpResidual {
 public:
  ChirpResidual(const FrameStack& stack, const std::vector<Complex>& average, Complex gain, int shot, int slot)
      : stack_(stack), average_(average), gain_(gain), shot_(shot), slot_(slot) {}
  bool used(int receiver, int sample) const { return stack_.use[place(receiver, sample)]; }
  /// 0 for an unusable value.
  Complex at(int receiver, int sample) const {
    const std::size_t i = place(receiver, sample);
    return stack_.use[i] ? stack_.x[i] - gain_ * average_[i % stack_.values()] : Complex(0);
  }
  /// Power by range bin, summed over receivers.
  std::vector<float> spectrum() const {
    thread_local Eigen::FFT<float> fft(Eigen::FFT<float>::impl_type(), Eigen::FFT<float>::Unscaled);
    std::vector<Complex> chirp(static_cast<std::size_t>(stack_.samples)), bins(chirp);
    std::vector<float> power(chirp.size(), 0.0f);
    for (int r = 0; r < stack_.receivers; ++r) {
      for (int n = 0; n < stack_.samples; ++n) chirp[static_cast<std::size_t>(n)] = at(r, n);
      fft.fwd(bins.data(), chirp.data(), stack_.samples);
      for (std::size_t b = 0; b < power.size(); ++b) power[b] += std::norm(bins[b]);
    }
    return power;
  }

 private:
  std::size_t place(int receiver, int sample) const {
    return stack_.at(shot_, slot_ * stack_.receivers + receiver, sample);
  }
  const FrameStack& stack_;
  const std::vector<Complex>& average_;
  Complex gain_;
  int shot_, slot_;
};

/// Samples of a chirp in which it differs most from the average.
struct BurstWindow {
  int begin = 0, length = 0;  ///< length 0: none
  double nats = 0;
};

/// Searches for bursts chirp by chirp.
class BurstSearch {
 public:
  BurstSearch(const FrameStack& stack, double noise_variance)
      : receivers_(stack.receivers),
        samples_(stack.samples),
        // Where noise is less than rounding, differences from the median are single-code steps, whose variance is at
        // most 1/4 for each of I and Q.
        scale_(std::max(noise_variance, 0.5)),
        energy_(static_cast<std::size_t>(stack.samples)),
        sum_(static_cast<std::size_t>(stack.samples) + 1, 0) {
    // Windows of 1, 2, 4, ... samples up to half a chirp.
    for (int w = 1; 2 * w <= samples_; w *= 2) {
      lengths_.push_back(w);
      thresholds_.push_back(
          boost::math::gamma_q_inv(static_cast<double>(receivers_) * w, bounds::kBurstWindowFalseAlarmRate) /
          (receivers_ * w));
    }
  }
  /// Reads the energy of a chirp's samples over the noise; false where no sample is usable.
  bool read(const ChirpResidual& chirp) {
    sorted_.clear();
    for (int n = 0; n < samples_; ++n) {
      double e = 0;
      int count = 0;
      for (int r = 0; r < receivers_; ++r) {
        if (!chirp.used(r, n)) continue;
        e += std::norm(chirp.at(r, n));
        ++count;
      }
      const auto i = static_cast<std::size_t>(n);
      energy_[i] = static_cast<float>(e / scale_ / receivers_);
      sum_[i + 1] = sum_[i] + energy_[i];
      if (count) sorted_.push_back(energy_[i]);
    }
    if (sorted_.empty()) return false;
    // A moving echo and a varying gain are in all samples of the chirp.
    level_ = std::max(1.0, static_cast<double>(medianOf(sorted_)));
    return true;
  }
  /// True where the chirp read last differs from the average as a whole.
  bool moves() const { return level_ > bounds::kLeastNoiseOfMover; }
  /// Window of the chirp read last that differs most from noise and moving echoes.
  BurstWindow window() const {
    const double least = moves() ? bounds::kLeastBurstOverMover : 1;
    BurstWindow best;
    for (std::size_t l = 0; l < lengths_.size(); ++l) {
      const int w = lengths_[l];
      const double threshold = level_ * std::max(thresholds_[l], least);
      for (int n = 0; n + w <= samples_; n += std::max(1, w / 4)) {
        const double mean = (sum_[static_cast<std::size_t>(n + w)] - sum_[static_cast<std::size_t>(n)]) / w;
        if (mean < threshold) continue;
        const double ratio = mean / level_, nats = receivers_ * w * (ratio - 1 - std::log(ratio));
        if (nats > best.nats) best = {n, w, nats};
      }
    }
    return best;
  }
  /// True where one direction holds most of a window's power beyond noise. A single receiver does not count: that is a
  /// fault of its converter.
  bool isOneWave(const ChirpResidual& chirp, const BurstWindow& window) const {
    Eigen::MatrixXcd covariance = Eigen::MatrixXcd::Zero(receivers_, receivers_);
    Eigen::VectorXcd sample(receivers_);
    for (int n = window.begin; n < window.begin + window.length; ++n) {
      for (int r = 0; r < receivers_; ++r) sample[r] = std::complex<double>(chirp.at(r, n));
      covariance += sample * sample.adjoint();
    }
    const double noise = scale_ * level_ * window.length, power = covariance.trace().real();
    const double first = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd>(covariance, Eigen::EigenvaluesOnly)
                             .eigenvalues()[receivers_ - 1];
    if (first - noise < bounds::kLeastShareOfOneWave * (power - receivers_ * noise)) return false;
    return receivers_ == 1 || !(covariance.diagonal().real().maxCoeff() > bounds::kMostShareOfOneReceiver * power);
  }

 private:
  int receivers_, samples_;
  double scale_;                    ///< noise variance of a sample
  std::vector<int> lengths_;        ///< of windows
  std::vector<double> thresholds_;  ///< mean energy of each that noise does not reach
  std::vector<float> energy_, sorted_;
  std::vector<double> sum_;  ///< energy of all samples before each one
  double level_ = 1;         ///< usual energy of the chirp's samples; 1 for noise
};

/// Discards a chirp.
void dropChirp(int shot, int slot, FrameStack& s) {
  for (int r = 0; r < s.receivers; ++r) {
    for (int n = 0; n < s.samples; ++n) {
      const std::size_t place = s.at(shot, slot * s.receivers + r, n);
      s.x[place] = 0;
      s.use[place] = 0;
    }
  }
}

}  // namespace

Bursts dropBursts(const std::vector<Complex>& average, double noise_variance, FrameStack& stack) {
  const std::vector<Complex> gains = commonGains(stack, average, noise_variance);
  BurstSearch search(stack, noise_variance);
  Bursts found;
  found.hit.assign(static_cast<std::size_t>(stack.shots()) * static_cast<std::size_t>(stack.slots), 0);
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(stack.frames), 0), hit(seen);
  for (int shot = 0; shot < stack.shots(); ++shot) {
    const auto frame = static_cast<std::size_t>(shot / stack.loops);
    for (int slot = 0; slot < stack.slots; ++slot) {
      const ChirpResidual chirp(stack, average, gains[static_cast<std::size_t>(shot)], shot, slot);
      if (!search.read(chirp)) continue;
      seen[frame] = 1;
      const BurstWindow window = search.window();
      if (window.length == 0) continue;
      // Limbs move at several speeds and may add up for a moment.
      if (search.moves() && isOfEchoes(chirp.spectrum())) continue;
      if (!search.isOneWave(chirp, window)) continue;
      found.log_likelihood_gain += window.nats;
      hit[frame] = 1;
      found.hit[static_cast<std::size_t>(shot * stack.slots + slot)] = 1;
      dropChirp(shot, slot, stack);
    }
  }
  for (std::size_t f = 0; f < seen.size(); ++f) {
    found.frames += seen[f];
    found.hit_frames += hit[f];
  }
  return found;
}

}  // namespace mmradartwin::diagnosis::frames
