#include "capture_check/chirp_boundary.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kOrder = 4;         ///< words of a lane that predict the next
constexpr std::size_t kFewestChirps = 4;  ///< in which a boundary is searched for
/// Share by which the nats of two breaks may differ because errors of the prediction are no Gaussian noise.
constexpr double kAlike = 0.02;
/// The same of runs that overlap: twice as much as in the sessions of another simulator.
constexpr double kAlikeOverlap = 0.3;
/// Nats of one lane beyond which a first glance is not enough.
constexpr double kGlanceNats = 3;
constexpr double kFalseAlarmRate = 1e-6;
constexpr std::size_t kGlancePeriods = 4;  ///< that a first glance takes
/// A word's error beyond three standard deviations is a break, not noise, and does not teach the prediction.
constexpr double kBreak = 9;

/// Squared errors of predicting each word from those before in its lane.
std::vector<double> squaredErrors(const std::vector<std::int16_t>& words, std::size_t stride, int rounds) {
  using Vector = Eigen::Matrix<double, static_cast<int>(kOrder), 1>;
  using Matrix = Eigen::Matrix<double, static_cast<int>(kOrder), static_cast<int>(kOrder)>;
  std::vector<double> error(words.size(), 0);
  double most = std::numeric_limits<double>::infinity();
  for (int round = 0; round < rounds; ++round) {
    Matrix normal = Matrix::Zero();
    Vector right = Vector::Zero(), before;
    for (std::size_t i = kOrder * stride; i < words.size(); ++i) {
      if (error[i] > most) continue;
      for (std::size_t p = 0; p < kOrder; ++p) before[static_cast<Eigen::Index>(p)] = words[i - (p + 1) * stride];
      normal.noalias() += before * before.transpose();
      right += before * static_cast<double>(words[i]);
    }
    normal.diagonal().array() += 1e-9 * normal.trace() + 1e-9;
    const Vector weights = normal.ldlt().solve(right);
    for (std::size_t i = kOrder * stride; i < words.size(); ++i) {
      double predicted = 0;
      for (std::size_t p = 0; p < kOrder; ++p)
        predicted += weights[static_cast<Eigen::Index>(p)] * words[i - (p + 1) * stride];
      error[i] = std::pow(words[i] - predicted, 2);
    }
    if (round + 1 == rounds) break;
    std::vector<double> sorted(error.begin() + static_cast<std::ptrdiff_t>(kOrder * stride), error.end());
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    most = kBreak * (*middle / 0.455 + kRoundingVariance);  // the median of a squared normal error is 0.455 variances
  }
  return error;
}

/// Mean squared error of each word of a period over some periods, without the larger half of them: bursts are in
/// few.
std::vector<double> trimmedMeans(const std::vector<double>& error, std::size_t period, std::size_t first,
                                 std::size_t last) {
  std::vector<double> means(period), values(last - first);
  const std::size_t dropped = values.size() / 2, kept = values.size() - dropped;
  for (std::size_t i = 0; i < period; ++i) {
    for (std::size_t p = first; p < last; ++p) values[p - first] = error[p * period + i];
    if (dropped > 0) std::sort(values.begin(), values.end());
    means[i] = std::accumulate(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(kept), 0.0) /
                   static_cast<double>(kept) +
               kRoundingVariance;
  }
  return means;
}

/// Nats of one period by which each of its words breaks with those before, in either half of the periods.
std::vector<double> breaksOfWords(const std::vector<double>& error, std::size_t period) {
  const std::size_t periods = error.size() / period, half = (periods + 1) / 2;
  // The first period has no words before it. What breaks in one half alone is a lost packet, not the beginning.
  std::vector<std::pair<std::size_t, std::size_t>> halves = {{1, periods}};
  if (periods >= 5) halves = {{1, half}, {half, periods}};
  std::vector<double> nats(period, std::numeric_limits<double>::infinity());
  for (const auto& [first, last] : halves) {
    const std::vector<double> mean = trimmedMeans(error, period, first, last);
    std::vector<double> sorted = mean;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(period / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    for (std::size_t i = 0; i < period; ++i) {
      const double ratio = std::max(1.0, mean[i] / *middle);
      nats[i] = std::min(nats[i], 0.5 * (ratio - 1 - std::log(ratio)));
    }
  }
  return nats;
}

/// The same of the words of a run from each word on.
std::vector<double> breaksOfRuns(const std::vector<double>& nats, std::size_t run) {
  std::vector<double> sum(nats.size(), 0);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    for (std::size_t j = 0; j < std::min(run, nats.size()); ++j) sum[i] += nats[(i + j) % nats.size()];
  }
  return sum;
}

/// How alike the phase steps from element to element are along the whole virtual line: mean over range bins of the
/// share of the power that one step explains. Few bins hold most of the power, and leakage is unlike an echo.
double smoothness(const ByteReading& reading, std::size_t slots, const std::int16_t* words, std::size_t count) {
  const auto spectra = averageSpectra(reading, slots, words, count);
  double sum = 0;
  for (std::size_t r = 0; r < reading.samples; ++r) {
    std::complex<double> steps = 0;
    double power = 0;
    for (std::size_t k = 0; k + 1 < spectra.size(); ++k) {
      steps += std::conj(spectra[k][r]) * spectra[k + 1][r];
      power += 0.5 * (std::norm(spectra[k][r]) + std::norm(spectra[k + 1][r]));
    }
    if (power > 0) sum += std::abs(steps) / power;
  }
  return sum;
}

/// True where a lane is worth looking at: its words change.
bool varies(const ByteReading& reading, const std::vector<std::int16_t>& words, std::size_t word, std::size_t step) {
  for (std::size_t i = word + step; i < reading.words(); i += step) {
    if (words[i] != words[word]) return true;
  }
  return false;
}

/// Every `step`-th word from `first` on.
std::vector<std::int16_t> lane(const std::vector<std::int16_t>& words, std::size_t first, std::size_t step,
                               std::size_t most) {
  std::vector<std::int16_t> result;
  for (std::size_t i = first; i < words.size() && result.size() < most; i += step) result.push_back(words[i]);
  return result;
}

/// True where the first period breaks where it begins, too: the words begin with a chirp and slip later, by a lost
/// packet.
bool slipsLater(const std::vector<double>& error, std::size_t period, std::size_t run, std::size_t word) {
  constexpr double kShare = 0.25;  ///< of the break there; noise alone makes less
  if (std::min(word, period - word) < run || error.size() < 2 * period + run) return false;
  std::vector<double> sorted(error.begin() + static_cast<std::ptrdiff_t>(period), error.end());
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double noise = static_cast<double>(run) * *middle / 0.455;
  const auto of_run = [&](std::size_t begin) {
    const auto first = error.begin() + static_cast<std::ptrdiff_t>(period + begin);
    return std::accumulate(first, first + static_cast<std::ptrdiff_t>(run), 0.0) - noise;
  };
  return of_run(0) > kShare * of_run(word);
}

/// How the words of a reading repeat.
struct Rhythm {
  std::size_t stride;  ///< from a word to the next of its lane
  std::size_t period;  ///< after which another chirp, or another receiver's part of it, begins
};

Rhythm rhythmOf(const ByteReading& reading) {
  const bool pairs = reading.order == ByteReading::Order::kTwoLane && !reading.real;
  // Two lanes bring receiver after receiver, and each begins like a chirp.
  const bool by_receiver =
      reading.order == ByteReading::Order::kTwoLane || reading.order == ByteReading::Order::kPairsByReceiver;
  return {reading.wordOf(0, pairs ? 2 : 1), by_receiver ? reading.words() / reading.receivers : reading.words()};
}

}  // namespace

bool mayBeginWithin(const ByteReading& reading, const std::vector<std::int16_t>& words) {
  const Rhythm rhythm = rhythmOf(reading);
  if (words.size() < kFewestChirps * reading.words()) return false;
  std::vector<std::size_t> lanes;
  for (std::size_t i = 0; i < rhythm.stride; ++i) {
    if (varies(reading, words, i, rhythm.stride)) lanes.push_back(i);
  }
  if (lanes.empty()) return false;
  const std::size_t period = rhythm.period / rhythm.stride, periods = kGlancePeriods;
  for (const std::size_t i : {lanes.front(), lanes.back()}) {
    const std::vector<std::int16_t> of_lane = lane(words, i, rhythm.stride, (periods + 1) * period);
    const std::vector<double> nats = breaksOfWords(squaredErrors(of_lane, 1, 2), period),
                              sum = breaksOfRuns(nats, kOrder);
    const double most = *std::max_element(sum.begin(), sum.end());
    if (most > (1 + kAlike) * sum[0] + kGlanceNats) return true;
    // A run that begins a sample early holds the whole break as well.
    if (sum[0] > kGlanceNats && nats[0] < kAlike * sum[0]) return true;
  }
  return false;
}

std::optional<ChirpBoundary> findChirpBoundary(const ByteReading& reading, std::size_t slots,
                                               const std::vector<std::int16_t>& words) {
  const std::size_t chirp = reading.words();
  if (words.size() < kFewestChirps * chirp) return std::nullopt;
  const auto [stride, period] = rhythmOf(reading);
  const std::vector<double> error = squaredErrors(words, stride, 3);
  const std::vector<double> sum = breaksOfRuns(breaksOfWords(error, period), kOrder * stride);
  const auto peak = static_cast<std::size_t>(std::max_element(sum.begin(), sum.end()) - sum.begin());
  const std::size_t used = (words.size() / chirp - 1) / slots * slots * chirp;
  const auto at = [&](std::size_t word) {
    const auto begin = words.begin() + static_cast<std::ptrdiff_t>(word);
    const std::vector<std::int16_t> quiet =
        quietLoops({begin, begin + static_cast<std::ptrdiff_t>(used)}, slots * chirp);
    return concentrationOf(reading, slots, quiet.data(), quiet.size());
  };
  // A shift by a whole sample hardly changes the spectra, so that they tell the word within a sample, and the break
  // tells the sample.
  const std::size_t glance = std::min(used, 2 * slots * chirp);
  std::vector<std::pair<std::size_t, Concentration>> near;
  for (std::size_t i = 0; i < 2 * stride + 1; ++i) {
    const std::size_t word = (peak + period + i - stride) % period;
    near.emplace_back(word, concentrationOf(reading, slots, words.data() + word, glance));
  }
  double most = -std::numeric_limits<double>::infinity();
  for (const auto& [word, there] : near) most = std::max(most, there.nats);
  const auto alike = [&](const Concentration& there) { return there.nats > most - std::sqrt(there.variance) / 2; };
  double most_alike = 0;
  for (const auto& [word, there] : near) {
    if (alike(there)) most_alike = std::max(most_alike, sum[word]);
  }
  // Of those that hold the whole break the last: the others begin early.
  const auto* best = &near.front();
  for (const auto& candidate : near) {
    if (alike(candidate.second) && sum[candidate.first] >= (1 - kAlike) * most_alike) best = &candidate;
  }
  if (best->first == 0) return std::nullopt;
  if (slipsLater(error, period, kOrder * stride, best->first)) return std::nullopt;
  ChirpBoundary found{best->first, period, stride, at(best->first), at(0), sum[best->first], sum[0], sum, {}};
  // Which receiver and slot begins there, the array tells.
  const std::size_t loop = slots * chirp, loops = words.size() / loop;
  for (std::size_t begin = found.word; begin < loop && loops > 1; begin += period) {
    found.smoothness.push_back(smoothness(reading, slots, words.data() + begin, (loops - 1) * loop));
  }
  return found;
}

bool ChirpBoundary::breaksThere(double tries) const {
  const double least = std::log(tries * static_cast<double>(period) / kFalseAlarmRate);
  const double chance = std::sqrt(from_there.variance + from_the_start.variance);
  // Runs that overlap share most of the break, and errors of the prediction fill the rest.
  const bool overlap = std::min(word, period - word) < kOrder * stride;
  return nats > (1 + (overlap ? kAlikeOverlap : kAlike)) * nats_at_start + least &&
         from_there.nats > from_the_start.nats - chance;
}

}  // namespace mmradartwin
