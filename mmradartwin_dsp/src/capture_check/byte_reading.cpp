#include "capture_check/byte_reading.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin {
namespace {

using Complex = std::complex<double>;
using Order = ByteReading::Order;

/// Variance of the log of an exponentially distributed power: pi^2/6.
constexpr double kLogVariance = 1.6449;
/// Neighbouring bins of a Hann window are correlated: that many bins count as one.
constexpr double kBinsAlike = 1.5;

Eigen::FFT<double>& fft() {
  thread_local Eigen::FFT<double> fft(Eigen::FFT<double>::impl_type(), Eigen::FFT<double>::Unscaled);
  return fft;
}

/// Spectra of all chirps of words, visited as (chirp, receiver, spectrum); unitary, so that a bin's power is a sample's
/// variance.
template <typename Visit>
void forEachSpectrum(const ByteReading& reading, const std::int16_t* words, std::size_t count, Visit visit) {
  const std::size_t N = reading.samples, chirps = count / reading.words();
  const std::vector<double> hann = hannWindow(static_cast<int>(N));
  double squares = 0;
  for (const double w : hann) squares += w * w;
  const double scale = 1 / std::sqrt(squares);
  std::vector<Complex> time(N), spectrum(N);
  for (std::size_t chirp = 0; chirp < chirps; ++chirp) {
    const std::int16_t* in = words + chirp * reading.words();
    for (std::size_t rx = 0; rx < reading.receivers; ++rx) {
      for (std::size_t n = 0; n < N; ++n) {
        const std::size_t at = reading.wordOf(rx, n);
        const Complex value(in[at], reading.real ? 0.0 : static_cast<double>(in[at + reading.qBehind()]));
        time[n] = hann[n] * scale * value;
      }
      fft().fwd(spectrum.data(), time.data(), static_cast<Eigen::Index>(N));
      visit(chirp, rx, spectrum);
    }
  }
}

}  // namespace

std::string ByteReading::name() const {
  static const char* const kNames[] = {"4lane", "2lane", "pairs I Q, receiver by receiver",
                                       "pairs I Q, sample by sample"};
  return (real ? "real samples in " : "") + std::string(kNames[static_cast<int>(order)]);
}

std::string ByteReading::advice() const {
  if (order == Order::kPairsByReceiver || order == Order::kPairsBySample) {
    return "write the samples in layout 4lane or 2lane (contracts, section 5)";
  }
  const std::string layout = order == Order::kFourLane ? "4lane" : "2lane";
  return "set layout: " + layout + (real ? " and samples: real" : "") + " in radar.yaml";
}

std::size_t ByteReading::words() const {
  return samples * (order == Order::kFourLane ? lanes : receivers) * (real ? 1 : 2);
}

std::size_t ByteReading::wordOf(std::size_t receiver, std::size_t sample) const {
  switch (order) {
    case Order::kFourLane:
      return sample * lanes * (real ? 1 : 2) + receiver;
    case Order::kTwoLane:
      return real ? receiver * samples + sample : 2 * receiver * samples + sample / 2 * 4 + sample % 2;
    case Order::kPairsByReceiver:
      return 2 * (receiver * samples + sample);
    case Order::kPairsBySample:
      return 2 * (sample * receivers + receiver);
  }
  return 0;
}

std::size_t ByteReading::qBehind() const {
  switch (order) {
    case Order::kFourLane:
      return lanes;
    case Order::kTwoLane:
      return 2;
    default:
      return 1;
  }
}

ByteReading statedReading(const RadarConfig& radar) {
  ByteReading stated;
  stated.order = radar.layout == CaptureLayout::kTwoLane ? Order::kTwoLane : Order::kFourLane;
  stated.real = radar.real_samples;
  stated.samples = static_cast<std::size_t>(radar.samples_per_chirp) * (radar.real_samples ? 2 : 1);
  stated.receivers = static_cast<std::size_t>(radar.receivers());
  stated.lanes = std::max<std::size_t>(4, stated.receivers);
  return stated;
}

std::vector<ByteReading> otherReadings(const RadarConfig& radar) {
  const ByteReading stated = statedReading(radar);
  std::vector<ByteReading> others;
  const auto add = [&](Order order, bool real) {
    if (order == stated.order && real == stated.real) return;
    if (stated.samples % 2 != 0 && (real || order == Order::kTwoLane)) return;
    ByteReading other = stated;
    other.order = order;
    other.real = real;
    others.push_back(other);
  };
  for (const bool real : {false, true}) {
    add(Order::kFourLane, real);
    add(Order::kTwoLane, real);
  }
  add(Order::kPairsByReceiver, false);
  // One receiver alone: the same as by receiver.
  if (stated.receivers > 1) add(Order::kPairsBySample, false);
  return others;
}

std::vector<std::int16_t> quietLoops(const std::vector<std::int16_t>& words, std::size_t loop) {
  const std::size_t loops = words.size() / loop;
  if (loops < 3) return words;
  const auto differs = [&](std::size_t a, std::size_t b) {
    double sum = 0;
    for (std::size_t i = 0; i < loop; ++i) sum += std::pow(words[a * loop + i] - words[b * loop + i], 2);
    return sum;
  };
  std::vector<double> to_next;
  for (std::size_t i = 0; i + 1 < loops; ++i) to_next.push_back(differs(i, i + 1));
  std::vector<std::pair<double, std::size_t>> least;
  for (std::size_t i = 0; i < loops; ++i) {
    const double before = to_next[i > 0 ? i - 1 : 0], behind = to_next[i + 1 < loops ? i : i - 1];
    least.emplace_back(std::min(before, behind), i);
  }
  std::sort(least.begin(), least.end());
  std::vector<std::int16_t> quiet;
  for (std::size_t i = 0; i < (loops + 1) / 2; ++i) {
    const auto begin = words.begin() + static_cast<std::ptrdiff_t>(least[i].second * loop);
    quiet.insert(quiet.end(), begin, begin + static_cast<std::ptrdiff_t>(loop));
  }
  return quiet;
}

Concentration concentrationOf(const ByteReading& reading, std::size_t slots, const std::int16_t* words,
                              std::size_t count) {
  const std::size_t N = reading.samples, groups = slots * reading.receivers;
  const std::size_t chirps = count / reading.words();
  std::vector<double> power(N, 0), standing(N, 0);
  std::vector<std::vector<Complex>> sums(groups, std::vector<Complex>(N));
  forEachSpectrum(reading, words, count, [&](std::size_t chirp, std::size_t rx, const std::vector<Complex>& spectrum) {
    std::vector<Complex>& sum = sums[chirp % slots * reading.receivers + rx];
    for (std::size_t r = 0; r < N; ++r) {
      power[r] += std::norm(spectrum[r]);
      sum[r] += spectrum[r];
    }
  });
  const double looks = static_cast<double>(chirps * reading.receivers);
  const double repeats = static_cast<double>(chirps) / static_cast<double>(slots);
  for (const std::vector<Complex>& sum : sums) {
    for (std::size_t r = 0; r < N; ++r) standing[r] += std::norm(sum[r]) / repeats;
  }
  Concentration result;
  double weights = 0;
  // Of a real signal, half of the bins are the mirror image of the other half, and those at the ends are real.
  const std::size_t bins = reading.real ? N / 2 + 1 : N;
  for (std::size_t r = 0; r < bins; ++r) {
    const double weight = reading.real && (r == 0 || r == N / 2) ? 0.5 : 1;
    // Only what stands from chirp to chirp may fluctuate as one look; noise is averaged over all of them.
    double share = power[r] > 0 ? standing[r] / power[r] : 0;
    share = repeats > 1 ? std::clamp((share - 1 / repeats) / (1 - 1 / repeats), 0.0, 1.0) : 1.0;
    const double floor = reading.real ? kRoundingVariance : 2 * kRoundingVariance;
    const double variance_of_word = (power[r] / looks + floor) / (reading.real ? 1 : 2);
    result.nats -= weight * std::log(variance_of_word);
    result.variance +=
        weight * weight * kLogVariance * share * share + weight * weight * (1 - share) * (1 - share) / looks;
    weights += weight;
  }
  result.nats /= weights;
  result.variance *= kBinsAlike / (weights * weights);
  return result;
}

std::vector<std::vector<Complex>> averageSpectra(const ByteReading& reading, std::size_t slots,
                                                 const std::int16_t* words, std::size_t count) {
  std::vector<std::vector<Complex>> sums(slots * reading.receivers, std::vector<Complex>(reading.samples));
  forEachSpectrum(reading, words, count, [&](std::size_t chirp, std::size_t rx, const std::vector<Complex>& spectrum) {
    std::vector<Complex>& sum = sums[chirp % slots * reading.receivers + rx];
    for (std::size_t r = 0; r < spectrum.size(); ++r) sum[r] += spectrum[r];
  });
  return sums;
}

}  // namespace mmradartwin
