#include "diagnosis/frames/frame_laws.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin::diagnosis::frames {
namespace {

using Complex = std::complex<float>;

constexpr int kFewestFrames = 8;          ///< that show a law
constexpr std::size_t kFewestEchoes = 3;  ///< that make a law common
constexpr double kLeastPeak = 0.002;      ///< power of an echo, of that of the strongest
constexpr double kLeastVarying = 0.6;     ///< share of the echoes that vary by a common law
constexpr double kMostLeft = 0.3;         ///< share of its variation that a common law leaves in the median echo
constexpr double kLeastPhase_rad = 0.05;  ///< rms, of all echoes or of one
constexpr double kLeastLevel_db = 0.3;    ///< rms of the same
constexpr double kMostPhase_rad = 1.1;    ///< rms; beyond it something moves, since its phase wraps
constexpr double kMostBeside = 0.1;       ///< share of an echo's variation in other directions than its own
constexpr double kBesideCommon = 0.5;     ///< of a common phase, that an echo's own has to exceed
constexpr double kOneSided = 0.3;         ///< of phase and level, what the smaller one has of the larger
constexpr double kLeastOverNoise = 9;     ///< of a variation's power

/// Standing echo: a range bin that exceeds its neighbours.
struct Peak {
  int bin = 0;
  Eigen::VectorXcd direction;            ///< of its channels, unit length
  std::vector<std::complex<double>> at;  ///< [frame] amplitude, relative to the mean modulus
  double noise = 0;                      ///< variance of `at`
  double beside = 0;                     ///< share of the variation in other directions
};

double meanSquare(const std::vector<double>& v) {
  double sum = 0;
  for (double x : v) sum += x * x;
  return v.empty() ? 0 : sum / static_cast<double>(v.size());
}

/// Values less their mean.
std::vector<double> centred(std::vector<double> v) {
  const double mean = std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
  for (double& x : v) x -= mean;
  return v;
}

class Laws {
 public:
  Laws(const RadarConfig& radar, const StandingSpectra& s) : radar_(radar), s_(s) {
    for (std::size_t i = 0; i < s.shot.size(); ++i) {
      const int frame = s.shot[i] / s.loops;
      if (frame_.empty() || frame_.back() != frame) {
        frame_.push_back(frame);
        begin_.push_back(i);
      }
    }
    begin_.push_back(s.shot.size());
  }

  const std::vector<double>& level_db() const { return level_db_; }
  std::vector<FrameLaw> take() {
    std::vector<FrameLaw> laws;
    if (static_cast<int>(frames()) < kFewestFrames) return laws;
    readFrames();
    const std::vector<Peak> all = peaks();
    if (all.empty()) return laws;
    if (const FrameLaw phase = commonPhase(all); phase.rms > 0) laws.push_back(phase);
    if (const FrameLaw level = commonLevel(all); level.rms > 0) laws.push_back(level);
    if (!laws.empty()) straighten();
    for (int echo = 0; echo < kMostEchoes; ++echo) {
      const FrameLaw law = lawOfOne();
      if (!(law.rms > 0)) break;
      laws.push_back(law);
    }
    return laws;
  }

 private:
  std::size_t frames() const { return frame_.size(); }
  std::size_t cell(std::size_t shot, int bin) const {
    return (shot * static_cast<std::size_t>(s_.bins) + static_cast<std::size_t>(bin)) *
           static_cast<std::size_t>(s_.channels);
  }
  Eigen::Map<Eigen::VectorXcf> residual(std::size_t shot, int bin) const {
    return Eigen::Map<Eigen::VectorXcf>(&(*s_.residual)[cell(shot, bin)], s_.channels);
  }
  Eigen::Map<Eigen::VectorXcf> average(int bin) const {
    return Eigen::Map<Eigen::VectorXcf>(&(*s_.average)[cell(0, bin)], s_.channels);
  }

  /// Means of the frames [frame][bin], and the noise of one of their values.
  void readFrames() {
    mean_.assign(frames(), std::vector<Eigen::VectorXcd>(static_cast<std::size_t>(s_.bins)));
    std::vector<double> varied(static_cast<std::size_t>(s_.bins), 0);
    for (int b = 0; b < s_.bins; ++b) {
      for (std::size_t f = 0; f < frames(); ++f) {
        Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(s_.channels);
        for (std::size_t i = begin_[f]; i < begin_[f + 1]; ++i) {
          sum += (residual(i, b) + Complex((*s_.gain)[i]) * average(b)).cast<std::complex<double>>();
        }
        mean_[f][static_cast<std::size_t>(b)] = sum / static_cast<double>(begin_[f + 1] - begin_[f]);
      }
      for (std::size_t i = 0; i < s_.shot.size(); ++i)
        varied[static_cast<std::size_t>(b)] += residual(i, b).squaredNorm();
    }
    // Noise fills all bins alike: the steadiest hold only noise.
    std::sort(varied.begin(), varied.end());
    const double shots = static_cast<double>(s_.shot.size());
    noise_ = varied[varied.size() / 10] / (shots * s_.channels) * static_cast<double>(frames()) / shots;
  }

  /// Standing echoes, from the frames' means.
  std::vector<Peak> peaks() const {
    std::vector<double> power(static_cast<std::size_t>(s_.bins), 0);
    for (const auto& frame : mean_) {
      for (std::size_t b = 0; b < power.size(); ++b) power[b] += frame[b].squaredNorm() / static_cast<double>(frames());
    }
    // Below it, a maximum may be a sidelobe of Hann's window.
    const double least = kLeastPeak * *std::max_element(power.begin(), power.end());
    std::vector<Peak> all;
    for (int b = 1; b + 1 < s_.bins; ++b) {
      const auto i = static_cast<std::size_t>(b);
      if (power[i] < power[i - 1] || power[i] < power[i + 1]) continue;
      if (power[i] < std::max(least, bounds::kLeastStandingOverNoise * s_.channels * noise_)) continue;
      all.push_back(peakAt(b));
    }
    return all;
  }

  Peak peakAt(int bin) const {
    Peak peak;
    peak.bin = bin;
    const auto b = static_cast<std::size_t>(bin);
    Eigen::MatrixXcd covariance = Eigen::MatrixXcd::Zero(s_.channels, s_.channels);
    Eigen::VectorXcd mean = Eigen::VectorXcd::Zero(s_.channels);
    for (const auto& frame : mean_) {
      covariance += frame[b] * frame[b].adjoint();
      mean += frame[b] / static_cast<double>(frames());
    }
    peak.direction = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd>(covariance).eigenvectors().col(s_.channels - 1);
    double modulus = 0, all = 0, own = 0;
    for (const auto& frame : mean_) {
      peak.at.push_back(peak.direction.dot(frame[b]));
      modulus += std::abs(peak.at.back()) / static_cast<double>(frames());
      all += (frame[b] - mean).squaredNorm();
      own += std::norm(peak.direction.dot(frame[b] - mean));
    }
    const double noise = static_cast<double>(frames()) * noise_;
    peak.beside = std::max(0.0, all - own - (s_.channels - 1) * noise) / std::max(all, 1e-30);
    for (auto& v : peak.at) v /= modulus;
    peak.noise = noise_ / (modulus * modulus);
    return peak;
  }

  /// Phases of an echo about their mean, by the frame.
  static std::vector<double> phases(const Peak& peak) {
    std::complex<double> sum = 0;
    for (const auto& v : peak.at) sum += v / std::max(std::abs(v), 1e-12);
    std::vector<double> phase;
    for (const auto& v : peak.at) {
      const double turn = std::arg(v * std::conj(sum));
      phase.push_back(phase.empty() ? turn : phase.back() + std::remainder(turn - phase.back(), 2 * M_PI));
    }
    return centred(phase);
  }
  static std::vector<double> levels_db(const Peak& peak) {
    std::vector<double> level;
    for (const auto& v : peak.at) level.push_back(20 * std::log10(std::max(std::abs(v), 1e-6)));
    return centred(level);
  }

  /// What the echoes' series have in common: the median over echoes, each divided by its weight.
  static std::vector<double> common(const std::vector<std::vector<double>>& series, const std::vector<double>& weight) {
    std::vector<double> middle;
    for (std::size_t f = 0; f < series.front().size(); ++f) {
      std::vector<double> values;
      for (std::size_t i = 0; i < series.size(); ++i) values.push_back(series[i][f] / weight[i]);
      middle.push_back(quantile(values, 0.5));
    }
    return middle;
  }

  /// Share of its variation that a common series leaves in the median echo; 1 where too few echoes vary.
  static double left(const std::vector<std::vector<double>>& series, const std::vector<double>& weight,
                     const std::vector<double>& noise, const std::vector<double>& shared) {
    std::vector<double> ratio;
    for (std::size_t i = 0; i < series.size(); ++i) {
      const double before = meanSquare(series[i]);
      if (before < kLeastOverNoise * noise[i]) continue;
      std::vector<double> rest = series[i];
      for (std::size_t f = 0; f < rest.size(); ++f) rest[f] -= weight[i] * shared[f];
      ratio.push_back(std::max(0.0, meanSquare(rest) - noise[i]) / before);
    }
    const auto least = std::max<double>(kFewestEchoes, kLeastVarying * static_cast<double>(series.size()));
    return static_cast<double>(ratio.size()) < least ? 1 : quantile(ratio, 0.5);
  }

  /// Mean logarithm of what a common series leaves in the echoes: which of two laws it is.
  static double logLeft(const std::vector<std::vector<double>>& series, const std::vector<double>& weight,
                        const std::vector<double>& shared) {
    double sum = 0;
    for (std::size_t i = 0; i < series.size(); ++i) {
      std::vector<double> rest = series[i];
      for (std::size_t f = 0; f < rest.size(); ++f) rest[f] -= weight[i] * shared[f];
      sum += std::log(meanSquare(rest) + 1e-3 * meanSquare(series[i]) + 1e-12) / static_cast<double>(series.size());
    }
    return sum;
  }

  double middleFrame() const {
    return std::accumulate(frame_.begin(), frame_.end(), 0.0) / static_cast<double>(frames());
  }

  /// Takes the drift over frames that echoes share out of their series, rad per frame. It is another cause.
  double takeDrift(std::vector<std::vector<double>>& series) const {
    const double middle = middleFrame();
    double spread = 0;
    for (int f : frame_) spread += (f - middle) * (f - middle);
    std::vector<double> drifts;
    for (const std::vector<double>& v : series) {
      double with = 0;
      for (std::size_t f = 0; f < frames(); ++f) with += (frame_[f] - middle) * v[f];
      drifts.push_back(with / spread);
    }
    const double drift = quantile(drifts, 0.5);
    for (std::vector<double>& v : series) {
      for (std::size_t f = 0; f < frames(); ++f) v[f] -= drift * (frame_[f] - middle);
    }
    return drift;
  }

  FrameLaw commonPhase(const std::vector<Peak>& all) {
    std::vector<std::vector<double>> series;
    std::vector<double> alike, range_m, noise;
    for (const Peak& peak : all) {
      series.push_back(phases(peak));
      alike.push_back(1);
      range_m.push_back(peak.bin * radar_.range_bin_m());
      noise.push_back(0.5 * peak.noise);
    }
    FrameLaw law;
    law.frames = static_cast<int>(frames());
    const double drift = takeDrift(series);
    const std::vector<double> turn = common(series, alike), slope = common(series, range_m);
    const double left_alike = left(series, alike, noise, turn), left_range = left(series, range_m, noise, slope);
    if (std::min(left_alike, left_range) > kMostLeft) return law;
    const bool grows = logLeft(series, range_m, slope) < logLeft(series, alike, turn);
    const std::vector<double>& shared = grows ? slope : turn;
    const double rms = std::sqrt(meanSquare(centred(shared)));
    if ((grows ? rms * quantile(range_m, 0.5) : rms) < kLeastPhase_rad) return law;
    shared_rad_ = rms * (grows ? radar_.max_range_m() : 1);
    law.kind = grows ? FrameLawKind::kPhaseRange : FrameLawKind::kPhase;
    law.rms = rms;
    law.slope = drift;
    (grows ? slope_ : turn_) = shared;
    turn_.resize(frames(), 0.0);
    for (std::size_t f = 0; f < frames(); ++f) turn_[f] += drift * (frame_[f] - middleFrame());
    for (std::size_t i = 0; i < all.size(); ++i) {
      law.nats += 0.5 * static_cast<double>(frames()) * meanSquare(series[i]) / std::max(noise[i], 1e-12);
    }
    return law;
  }

  FrameLaw commonLevel(const std::vector<Peak>& all) {
    std::vector<std::vector<double>> series;
    std::vector<double> alike, noise;
    const double db = 20 / std::log(10.0);
    for (const Peak& peak : all) {
      series.push_back(levels_db(peak));
      alike.push_back(1);
      noise.push_back(0.5 * peak.noise * db * db);
    }
    FrameLaw law;
    law.frames = static_cast<int>(frames());
    law.kind = FrameLawKind::kLevel;
    const std::vector<double> shared = common(series, alike);
    const double rms = std::sqrt(meanSquare(shared));
    if (left(series, alike, noise, shared) > kMostLeft || rms < kLeastLevel_db) return law;
    law.rms = rms;
    level_db_ = shared;
    for (std::size_t i = 0; i < all.size(); ++i) {
      law.nats += 0.5 * static_cast<double>(frames()) * meanSquare(series[i]) / std::max(noise[i], 1e-12);
    }
    return law;
  }

  /// Undoes the common laws and forms average and residuals anew, without the gain of all cells, which follows the
  /// strongest echo where that has a law of its own.
  void straighten() {
    straight_ = true;
    for (std::size_t f = 0; f < frames(); ++f) {
      for (int b = 0; b < s_.bins; ++b) {
        const double angle =
            (turn_.empty() ? 0 : turn_[f]) + (slope_.empty() ? 0 : slope_[f] * b * radar_.range_bin_m());
        const double level = level_db_.empty() ? 1 : std::pow(10, level_db_[f] / 20);
        const auto back = Complex(std::polar(1 / level, -angle));
        for (std::size_t i = begin_[f]; i < begin_[f + 1]; ++i) {
          residual(i, b) = (back * (residual(i, b) + Complex((*s_.gain)[i]) * average(b))).eval();
        }
      }
    }
    for (int b = 0; b < s_.bins; ++b) {
      Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(s_.channels);
      for (std::size_t i = 0; i < s_.shot.size(); ++i) sum += residual(i, b).cast<std::complex<double>>();
      average(b) = (sum / static_cast<double>(s_.shot.size())).cast<Complex>();
      for (std::size_t i = 0; i < s_.shot.size(); ++i) residual(i, b) -= average(b);
    }
    std::fill(s_.gain->begin(), s_.gain->end(), 1.0);
    readFrames();
  }

  /// Law of the one echo that varies most, and takes its series out of all bins.
  FrameLaw lawOfOne() {
    FrameLaw law, best;
    best.common = false;
    double most = 0;
    Peak found;
    const std::vector<Peak> all = peaks();
    // Beside fewer echoes nobody knows whether it is the one or the radar.
    if (all.size() < kFewestEchoes) return best;
    for (const Peak& peak : all) {
      const std::vector<double> phase = phases(peak), level_db = levels_db(peak);
      const double turn = std::sqrt(meanSquare(phase)),
                   amplitude = std::sqrt(meanSquare(level_db)) * std::log(10.0) / 20;
      const double noise = std::sqrt(0.5 * peak.noise);
      if (peak.beside > kMostBeside || std::max(turn, amplitude) < std::sqrt(kLeastOverNoise) * noise) continue;
      const bool turns = turn > std::max(kLeastPhase_rad, kBesideCommon * shared_rad_) && turn < kMostPhase_rad &&
                         amplitude < kOneSided * turn + noise;
      const bool fades = std::sqrt(meanSquare(level_db)) > kLeastLevel_db && turn < kOneSided * amplitude + noise;
      if (!turns && !fades) continue;
      law.kind = turns ? FrameLawKind::kPhase : FrameLawKind::kLevel;
      law.rms = turns ? turn : std::sqrt(meanSquare(level_db));
      law.nats = 0.5 * static_cast<double>(frames()) * (turns ? turn * turn : amplitude * amplitude) /
                 std::max(noise * noise, 1e-12);
      if (law.nats <= most) continue;
      most = law.nats;
      best.kind = law.kind;
      best.rms = law.rms;
      best.nats = law.nats;
      found = peak;
    }
    if (!(most > bounds::kConvincingNatsAtPose)) return best;
    if (!straight_) straighten();
    best.frames = static_cast<int>(frames());
    best.range_m = found.bin * radar_.range_bin_m();
    best.azimuth_rad = azimuthOf(found.direction);
    remove(found);
    return best;
  }

  double azimuthOf(const Eigen::VectorXcd& direction) const {
    double best = -1, azimuth = 0;
    for (int a = -120; a <= 120; ++a) {
      std::complex<double> sum = 0;
      const double sine = a / 121.0;
      for (int k = 0; k < s_.channels; ++k) {
        sum +=
            direction[k] * std::polar(1.0, 2 * M_PI * radar_.virtual_element_m(k).y() * sine / radar_.wavelength_m());
      }
      if (std::norm(sum) > best) best = std::norm(sum), azimuth = std::asin(sine);
    }
    return azimuth;
  }

  /// Takes the series of an echo out of all bins, which its window's sidelobes reach.
  void remove(const Peak& peak) {
    std::complex<double> mean = 0;
    for (const auto& v : peak.at) mean += v / static_cast<double>(frames());
    double power = 0;
    for (const auto& v : peak.at) power += std::norm(v - mean);
    for (int b = 0; b < s_.bins; ++b) {
      Eigen::VectorXcd with = Eigen::VectorXcd::Zero(s_.channels);
      for (std::size_t f = 0; f < frames(); ++f) {
        with += std::conj(peak.at[f] - mean) / power * mean_[f][static_cast<std::size_t>(b)];
      }
      for (std::size_t f = 0; f < frames(); ++f) {
        const Eigen::VectorXcf part = ((peak.at[f] - mean) * with).cast<Complex>();
        for (std::size_t i = begin_[f]; i < begin_[f + 1]; ++i) residual(i, b) -= part;
      }
    }
    readFrames();
  }

  static constexpr int kMostEchoes = 6;

  const RadarConfig& radar_;
  const StandingSpectra& s_;
  std::vector<int> frame_;
  std::vector<std::size_t> begin_;                   ///< [frame] first shot
  std::vector<std::vector<Eigen::VectorXcd>> mean_;  ///< [frame][bin] over its shots
  double noise_ = 0;                                 ///< variance of one value of mean_
  bool straight_ = false;
  double shared_rad_ = 0;                        ///< rms of a common phase at the far end
  std::vector<double> turn_, slope_, level_db_;  ///< [frame] common laws
};

}  // namespace

FrameLaws takeFrameLaws(const RadarConfig& radar, const StandingSpectra& spectra) {
  Laws laws(radar, spectra);
  FrameLaws taken;
  taken.laws = laws.take();
  taken.level_db = laws.level_db();
  return taken;
}

}  // namespace mmradartwin::diagnosis::frames
