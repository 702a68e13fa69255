#include "diagnosis/frames/frame_stack.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::frames {
namespace {

using Complex = std::complex<float>;

// No converter of these radars has fewer than 8 bits: a signal of fewer codes says nothing about its limits.
constexpr int kLeastCodes = 256;
// Codes inside of the outermost one that tell how often it should come.
constexpr int kNeighbours = 16;

// An echo that moves, with all of its limbs, holds a few neighbouring range bins; a burst sweeps over the whole band.
constexpr int kEchoesOfBand = 8;        // one is an eighth of it at most
constexpr double kShareOfEchoes = 0.8;  // of the power, by two of them

float medianOf(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2) return *middle;
  return 0.5f * (*middle + *std::max_element(values.begin(), middle));
}

/// The same sample of all shots counts as one.
double frameShare(const FrameStack& s) { return s.shots() > 0 ? 1.0 / s.shots() : 0; }

RailCounts countRail(const std::vector<int>& histogram, bool high, double share) {
  // histogram[i] counts code i - 32768.
  RailCounts c;
  const int codes = static_cast<int>(histogram.size());
  int edge = high ? codes - 1 : 0, far = high ? 0 : codes - 1;
  const int step = high ? -1 : 1;
  while (edge != far && histogram[static_cast<std::size_t>(edge)] == 0) edge += step;
  while (far != edge && histogram[static_cast<std::size_t>(far)] == 0) far -= step;
  c.code = edge - 32768;
  c.at_code = histogram[static_cast<std::size_t>(edge)] * share;
  const int inside = std::min(kNeighbours, std::abs(edge - far));
  double sum = 0;
  for (int i = 1; i <= inside; ++i) sum += histogram[static_cast<std::size_t>(edge + i * step)];
  c.next_codes = std::abs(edge - far) < kLeastCodes ? std::numeric_limits<double>::infinity() : sum * share / inside;
  return c;
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

Rails countRails(const FrameStack& s) {
  Rails rails;
  std::vector<int> histogram(65536, 0);
  long long count = 0;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    if (!s.use[i]) continue;
    ++histogram[static_cast<std::size_t>(static_cast<int>(s.x[i].real()) + 32768)];
    ++histogram[static_cast<std::size_t>(static_cast<int>(s.x[i].imag()) + 32768)];
    count += 2;
  }
  if (count == 0) return rails;
  rails.samples = static_cast<double>(count) * frameShare(s);
  rails.high = countRail(histogram, true, frameShare(s));
  rails.low = countRail(histogram, false, frameShare(s));
  return rails;
}

double pileUp(const RailCounts& counts) {
  // The density of a sine's values grows to its ends as 1/sqrt(A^2 - v^2): its outermost code holds 1 + sqrt(2) times
  // what the next one does. Half a sample more, since neighbours that are not there prove nothing.
  const double expected = (1 + std::sqrt(2.0)) * counts.next_codes + 0.5;
  if (!(counts.at_code > expected)) return 0;
  return counts.at_code * std::log(counts.at_code / expected) - (counts.at_code - expected);
}

ClippedValues clippedValues(const Rails& rails, const FrameStack& s) {
  ClippedValues clipped;
  const bool high = pileUp(rails.high) > 0, low = pileUp(rails.low) > 0;
  if (!high && !low) return clipped;
  const float infinity = std::numeric_limits<float>::infinity();
  const float top = high ? static_cast<float>(rails.high.code) : infinity;
  const float bottom = low ? static_cast<float>(rails.low.code) : -infinity;
  clipped.limit = std::min(top, -bottom);
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    if (!s.use[i]) continue;
    const auto beyond = [&](float v) { return v >= top || v <= bottom; };
    const int count = beyond(s.x[i].real()) + beyond(s.x[i].imag());
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
    // The average of what is clipped now and then stays below the limit.
    if (std::abs(average[at % s.values()]) < 0.8 * clipped.limit) continue;
    s.x[at] = 0;
    s.use[at] = 0;
  }
}

void countClipped(const ClippedValues& clipped, const Bursts& bursts, FrameStack& s, double& values, double& of) {
  const auto chirp = [&](std::size_t at) {
    const std::size_t shot = at / s.values(), channel = at % s.values() / static_cast<std::size_t>(s.samples);
    return shot * static_cast<std::size_t>(s.slots) + channel / static_cast<std::size_t>(s.receivers);
  };
  values = 0;
  double used = 0;
  for (std::size_t i = 0; i < s.use.size(); ++i) used += 2 * s.use[i];
  for (const auto& [at, count] : clipped.at) {
    if (bursts.hit[chirp(at)]) continue;
    values += count;
    if (!s.use[at]) used += 2;
    s.x[at] = 0;
    s.use[at] = 0;
  }
  values *= frameShare(s);
  of = used * frameShare(s);
}

std::vector<Complex> medianShot(const FrameStack& s) {
  std::vector<Complex> average(s.values());
  std::vector<float> re, im;
  const std::size_t values = s.values();
  // Blocks of places keep the walk over shots within the cache.
  for (std::size_t i = 0; i < values; ++i) {
    re.clear();
    im.clear();
    for (std::size_t at = i; at < s.x.size(); at += values) {
      if (!s.use[at]) continue;
      re.push_back(s.x[at].real());
      im.push_back(s.x[at].imag());
    }
    if (!re.empty()) average[i] = {medianOf(re), medianOf(im)};
  }
  return average;
}

std::vector<Complex> meanShot(const FrameStack& s) {
  const std::size_t values = s.values();
  std::vector<std::complex<double>> sum(values, 0);
  std::vector<int> count(values, 0);
  for (int shot = 0; shot < s.shots(); ++shot) {
    const std::size_t base = static_cast<std::size_t>(shot) * values;
    for (std::size_t i = 0; i < values; ++i) {
      if (!s.use[base + i]) continue;
      sum[i] += std::complex<double>(s.x[base + i]);
      ++count[i];
    }
  }
  std::vector<Complex> average(values);
  for (std::size_t i = 0; i < values; ++i) {
    if (count[i]) average[i] = Complex(sum[i] / static_cast<double>(count[i]));
  }
  return average;
}

std::vector<Complex> commonGains(const FrameStack& s, const std::vector<Complex>& average, double noise_variance) {
  std::vector<Complex> gains(static_cast<std::size_t>(s.shots()), 1);
  for (int shot = 0; shot < s.shots(); ++shot) {
    std::complex<double> with = 0;
    double power = 0;
    const std::size_t base = static_cast<std::size_t>(shot) * s.values();
    for (std::size_t i = 0; i < s.values(); ++i) {
      if (!s.use[base + i]) continue;
      with += std::complex<double>(std::conj(average[i]) * s.x[base + i]);
      power += std::norm(average[i]);
    }
    // The average itself carries 1/shots of the noise; ten times all noise in it is a signal.
    if (power > 10 * noise_variance * static_cast<double>(s.values()) / s.shots()) {
      gains[static_cast<std::size_t>(shot)] = Complex(with / power);
    }
  }
  return gains;
}

double differenceVariance(const FrameStack& s) {
  Eigen::FFT<float> fft(Eigen::FFT<float>::impl_type(), Eigen::FFT<float>::Unscaled);
  const std::vector<double> window = hannWindow(s.samples);
  std::vector<Complex> difference(static_cast<std::size_t>(s.samples)), spectrum(difference);
  std::vector<float> power(difference.size()), variances;
  for (int shot = 1; shot < s.shots(); ++shot) {
    for (int k = 0; k < s.channels(); ++k) {
      double window_power = 0;
      int count = 0;
      for (int n = 0; n < s.samples; ++n) {
        const std::size_t now = s.at(shot, k, n), before = s.at(shot - 1, k, n), i = static_cast<std::size_t>(n);
        const bool used = s.use[now] && s.use[before];
        difference[i] = used ? static_cast<float>(window[i]) * (s.x[now] - s.x[before]) : Complex(0);
        if (!used) continue;
        window_power += window[i] * window[i];
        ++count;
      }
      if (2 * count < s.samples) continue;
      fft.fwd(spectrum.data(), difference.data(), s.samples);
      std::transform(spectrum.begin(), spectrum.end(), power.begin(), [](const Complex& v) { return std::norm(v); });
      // The median of an exponential is ln 2 of its mean, and two shots differ by twice the noise of one.
      variances.push_back(medianOf(power) / static_cast<float>(2 * std::log(2.0) * window_power));
    }
  }
  // Rounding of I and Q: 1/12 each.
  return variances.empty() ? 1.0 / 6 : std::max<double>(medianOf(variances), 1.0 / 6);
}

void turnFrames(double rad_per_frame, FrameStack& s) {
  const std::size_t per_frame = static_cast<std::size_t>(s.loops) * s.values();
  for (int f = 1; f < s.frames; ++f) {
    const auto turn = Complex(std::polar(1.0, rad_per_frame * f));
    for (std::size_t i = 0; i < per_frame; ++i) s.x[static_cast<std::size_t>(f) * per_frame + i] *= turn;
  }
}

namespace {

/// Whether most of a power by range bin lies in two groups of neighbouring ones.
bool isOfEchoes(std::vector<float> power) {
  const std::size_t bins = power.size(), wide = std::max<std::size_t>(1, bins / kEchoesOfBand);
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
  return left < (1 - kShareOfEchoes) * all;
}

}  // namespace

Bursts dropBursts(const std::vector<Complex>& average, double noise_variance, FrameStack& s) {
  // Where noise is less than rounding, differences from the median are flips by one code, whose variance is at most 1/4
  // for each of I and Q.
  const double scale = std::max(noise_variance, 0.5);
  const std::vector<Complex> gains = commonGains(s, average, noise_variance);
  // Windows of 1, 2, 4, ... samples up to half a chirp; chance beats a threshold once in 1e12 windows, a session has
  // some 1e7.
  std::vector<int> lengths;
  std::vector<double> thresholds;
  for (int w = 1; 2 * w <= s.samples; w *= 2) {
    lengths.push_back(w);
    thresholds.push_back(boost::math::gamma_q_inv(static_cast<double>(s.receivers) * w, 1e-12) / (s.receivers * w));
  }
  Bursts found;
  found.hit.assign(static_cast<std::size_t>(s.shots()) * static_cast<std::size_t>(s.slots), 0);
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(s.frames), 0), hit(seen);
  std::vector<double> sum(static_cast<std::size_t>(s.samples) + 1, 0);
  std::vector<float> energy(static_cast<std::size_t>(s.samples)), sorted;
  Eigen::FFT<float> fft(Eigen::FFT<float>::impl_type(), Eigen::FFT<float>::Unscaled);
  std::vector<Complex> chirp(static_cast<std::size_t>(s.samples)), spectrum(chirp);
  for (int shot = 0; shot < s.shots(); ++shot) {
    for (int slot = 0; slot < s.slots; ++slot) {
      const Complex gain = gains[static_cast<std::size_t>(shot)];
      const auto residual = [&](std::size_t at) {
        return s.use[at] ? s.x[at] - gain * average[at % s.values()] : Complex(0);
      };
      sorted.clear();
      for (int n = 0; n < s.samples; ++n) {
        double e = 0;
        int count = 0;
        for (int r = 0; r < s.receivers; ++r) {
          const std::size_t at = s.at(shot, slot * s.receivers + r, n);
          if (!s.use[at]) continue;
          e += std::norm(residual(at));
          ++count;
        }
        energy[static_cast<std::size_t>(n)] = static_cast<float>(e / scale / s.receivers);
        sum[static_cast<std::size_t>(n) + 1] = sum[static_cast<std::size_t>(n)] + energy[static_cast<std::size_t>(n)];
        if (count) sorted.push_back(energy[static_cast<std::size_t>(n)]);
      }
      if (sorted.empty()) continue;
      seen[static_cast<std::size_t>(shot / s.loops)] = 1;
      // An echo that moves, or gain that flickers, is there in all samples of the chirp. Several such beat, and their
      // sum is distributed at most as noise is, one sample at each receiver alike: 16 times the median has a chance of
      // 2^-16 per sample, and thereby none in a window of several.
      const double level = std::max(1.0, static_cast<double>(medianOf(sorted)));
      const bool moves = level > 1.5;
      const double least = moves ? 16 : 1;
      double best_gain = 0;
      int best_begin = 0, best_length = 0;
      for (std::size_t l = 0; l < lengths.size(); ++l) {
        const int w = lengths[l];
        const double threshold = level * std::max(thresholds[l], least);
        for (int n = 0; n + w <= s.samples; n += std::max(1, w / 4)) {
          const double mean = (sum[static_cast<std::size_t>(n + w)] - sum[static_cast<std::size_t>(n)]) / w;
          if (mean < threshold) continue;
          const double ratio = mean / level, nats = s.receivers * w * (ratio - 1 - std::log(ratio));
          if (nats > best_gain) {
            best_gain = nats;
            best_begin = n;
            best_length = w;
          }
        }
      }
      if (best_length == 0) continue;
      if (moves) {  // limbs beat, and now and then all at once
        std::vector<float> power(chirp.size(), 0.0f);
        for (int r = 0; r < s.receivers; ++r) {
          for (int n = 0; n < s.samples; ++n) {
            chirp[static_cast<std::size_t>(n)] = residual(s.at(shot, slot * s.receivers + r, n));
          }
          fft.fwd(spectrum.data(), chirp.data(), s.samples);
          for (std::size_t b = 0; b < power.size(); ++b) power[b] += std::norm(spectrum[b]);
        }
        if (isOfEchoes(std::move(power))) continue;
      }
      // One wave at all receivers: one direction holds most of what is not noise.
      Eigen::MatrixXcd c = Eigen::MatrixXcd::Zero(s.receivers, s.receivers);
      Eigen::VectorXcd e(s.receivers);
      for (int n = best_begin; n < best_begin + best_length; ++n) {
        for (int r = 0; r < s.receivers; ++r) {
          e[r] = std::complex<double>(residual(s.at(shot, slot * s.receivers + r, n)));
        }
        c += e * e.adjoint();
      }
      const double noise = scale * level * best_length;
      const double first =
          Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd>(c, Eigen::EigenvaluesOnly).eigenvalues()[s.receivers - 1];
      if (first - noise < 0.7 * (c.trace().real() - s.receivers * noise)) continue;
      // Not one receiver alone: that is a fault of its converter, no wave.
      if (s.receivers > 1 && c.diagonal().real().maxCoeff() > 0.9 * c.trace().real()) continue;
      found.log_likelihood_gain += best_gain;
      hit[static_cast<std::size_t>(shot / s.loops)] = 1;
      found.hit[static_cast<std::size_t>(shot * s.slots + slot)] = 1;
      for (int r = 0; r < s.receivers; ++r) {
        for (int n = 0; n < s.samples; ++n) {
          const std::size_t at = s.at(shot, slot * s.receivers + r, n);
          s.x[at] = 0;
          s.use[at] = 0;
        }
      }
    }
  }
  for (std::size_t f = 0; f < seen.size(); ++f) {
    found.frames += seen[f];
    found.hit_frames += hit[f];
  }
  return found;
}

}  // namespace mmradartwin::diagnosis::frames
