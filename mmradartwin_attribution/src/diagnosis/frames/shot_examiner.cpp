#include "diagnosis/frames/shot_examiner.h"

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <unsupported/Eigen/FFT>
#include <utility>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/frames/doppler_frame.h"
#include "mmradartwin_dsp/chirp_period.h"

namespace mmradartwin::diagnosis::frames {
namespace {

using Complex = std::complex<float>;

constexpr int kLeastLoops = 16;             ///< loops of a Doppler spectrum: static echoes fill three of its bins
constexpr std::size_t kEchoesPerFrame = 3;  ///< moving echoes that are kept, the strongest
constexpr float kRemainderOfLaws = 0.01f;   ///< share of its power, by which what stands still varies beside laws
constexpr double kLimb_m = 0.75;            ///< between parts of a body
constexpr double kGhostBefore_m = 1;        ///< distance by which an echo over a wall may seem nearer than its body
constexpr double kAlike = 2;  ///< frames over which a body's echo is correlated, by which its average scatters more
constexpr int kSkirtBins = 8, kPeakBins = 2;  ///< distance from a cell that bounds its surroundings outside and inside

template <typename T>
T medianOfCopy(std::vector<T> values) {
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Median of values with weights; 0 without values.
double weightedMedian(std::vector<std::pair<double, double>>& values) {
  std::sort(values.begin(), values.end());
  double total = 0, sum = 0;
  for (const auto& [value, weight] : values) total += weight;
  for (const auto& [value, weight] : values) {
    sum += weight;
    if (2 * sum >= total) return value;
  }
  return values.empty() ? 0 : values.back().first;
}

/// Standard error of a median, from the scatter of the values about it: normal except for outliers.
template <typename T>
double errorOfMedian(std::vector<T> values, double median) {
  for (T& v : values) v = std::abs(v - median);
  return 1.25 * 1.48 * medianOfCopy(values) / std::sqrt(static_cast<double>(values.size()));
}

/// Variance of the slope over frames through independent errors.
double slopeVariance(double rms, int frames) { return 12 * rms * rms / std::pow(static_cast<double>(frames), 3); }

Eigen::FFT<float>& fft() {
  thread_local Eigen::FFT<float> fft(Eigen::FFT<float>::impl_type(), Eigen::FFT<float>::Unscaled);
  return fft;
}

/// Offset of a peak from the middle of three levels, by a parabola through their logarithms; at most 1/2 in magnitude.
double peakOffset(double left, double middle, double right) {
  if (!(left > 0 && middle > 0 && right > 0)) return 0;
  const double l = std::log(left), m = std::log(middle), r = std::log(right), curve = l - 2 * m + r;
  return curve < 0 ? std::clamp(0.5 * (l - r) / curve, -0.5, 0.5) : 0;
}

/// Bodies among the echoes of one frame. Arms and legs join the body that they are near and move with. Echoes over a
/// wall are left out.
std::vector<MovingEcho> bodiesOf(std::vector<MovingEcho> echoes) {
  struct Body {
    MovingEcho echo;
    double weight, sum_range, sum_azimuth, sum_speed;
  };
  std::sort(echoes.begin(), echoes.end(), [](const auto& p, const auto& q) { return p.snr > q.snr; });
  std::vector<Body> bodies;
  for (const MovingEcho& echo : echoes) {
    bool part = false, ghost = false;
    for (Body& body : bodies) {
      if (std::abs(echo.range_m - body.echo.range_m) < kLimb_m && echo.radial_m_per_s * body.echo.radial_m_per_s > 0) {
        body.weight += echo.snr;
        body.sum_range += echo.snr * echo.range_m;
        body.sum_azimuth += echo.snr * echo.azimuth_rad;
        body.sum_speed += echo.snr * echo.radial_m_per_s;
        part = true;
        break;
      }
      ghost |= echo.range_m > body.echo.range_m - kGhostBefore_m && echo.snr < bounds::kMostGhostShare * body.echo.snr;
    }
    if (part || ghost) continue;
    bodies.push_back(
        {echo, echo.snr, echo.snr * echo.range_m, echo.snr * echo.azimuth_rad, echo.snr * echo.radial_m_per_s});
  }
  std::vector<MovingEcho> means;
  for (Body& body : bodies) {
    body.echo.range_m = body.sum_range / body.weight;
    body.echo.azimuth_rad = body.sum_azimuth / body.weight;
    body.echo.radial_m_per_s = body.sum_speed / body.weight;
    means.push_back(body.echo);
  }
  return means;
}

}  // namespace

ShotExaminer::ShotExaminer(const RadarConfig& radar) : radar_(radar), chain_(radar) {
  for (double w : hannWindow(radar.samples_per_chirp)) window_.push_back(static_cast<float>(w));
  beams_.resize(radar.channels(), kAngleBins);
  for (int a = 0; a < kAngleBins; ++a) {
    const double azimuth_rad = axes().azimuth_rad[static_cast<std::size_t>(a)];
    beams_.col(a) = std::isnan(azimuth_rad) ? Eigen::VectorXcf::Zero(radar.channels()) : steering(azimuth_rad);
  }
}

double ShotExaminer::azimuth_rad(const Eigen::VectorXf& beam, int strongest) const {
  const double offset =
      peakOffset(beam[(strongest + kAngleBins - 1) % kAngleBins], beam[strongest], beam[(strongest + 1) % kAngleBins]);
  const double step = radar_.wavelength_m() / (2 * radar_.virtual_pitch_m()) / (kAngleBins / 2);
  return std::asin(std::clamp((strongest - kAngleBins / 2 + offset) * step, -1.0, 1.0));
}

Eigen::VectorXcf ShotExaminer::steering(double azimuth_rad) const {
  Eigen::VectorXcf v(radar_.channels());
  for (int k = 0; k < radar_.channels(); ++k) {
    const double y_m = radar_.virtual_element_m(k).y();
    v[k] = Complex(std::polar(1.0, -2 * M_PI * y_m * std::sin(azimuth_rad) / radar_.wavelength_m()));
  }
  return v;
}

ResidualSpectra ShotExaminer::spectra(const FrameStack& stack, const std::vector<Complex>& average) const {
  ResidualSpectra spectra;
  spectra.channels = stack.channels();
  spectra.bins = stack.samples;
  spectra.per_frame = stack.loops;
  const std::size_t values = stack.values();
  for (int shot = 0; shot < stack.shots(); ++shot) {
    const auto first = stack.use.begin() + static_cast<long>(static_cast<std::size_t>(shot) * values);
    const auto used = std::count(first, first + static_cast<long>(values), std::uint8_t{1});
    if (10 * static_cast<std::size_t>(used) >= 9 * values) spectra.shot.push_back(shot);
  }
  spectra.residual.resize(spectra.shot.size() * values);
  spectra.average.resize(values);
  std::vector<Complex> in(static_cast<std::size_t>(spectra.bins)), out(in);
  const auto transform = [&](Complex* to, int k) {
    fft().fwd(out.data(), in.data(), spectra.bins);
    for (int b = 0; b < spectra.bins; ++b) to[b * spectra.channels + k] = out[static_cast<std::size_t>(b)];
  };
  for (int k = 0; k < spectra.channels; ++k) {
    for (int n = 0; n < spectra.bins; ++n) {
      const auto i = static_cast<std::size_t>(n);
      in[i] = average[stack.at(0, k, n)] * window_[i];
    }
    transform(spectra.average.data(), k);
  }
  for (std::size_t i = 0; i < spectra.shot.size(); ++i) {
    for (int k = 0; k < spectra.channels; ++k) {
      const std::size_t at = stack.at(spectra.shot[i], k, 0), still = stack.at(0, k, 0);
      for (std::size_t n = 0; n < in.size(); ++n) {
        in[n] = stack.use[at + n] ? (stack.x[at + n] - average[still + n]) * window_[n] : 0;
      }
      transform(spectra.at(i, 0), k);
    }
  }
  return spectra;
}

double ShotExaminer::commonTurn(const FrameStack& stack) const {
  if (stack.frames < 3) return 0;
  const auto bins = static_cast<std::size_t>(stack.samples);
  std::vector<std::vector<std::complex<double>>> steps(bins);  // unit phasors from frame to frame
  std::vector<Complex> in(bins), before(bins), now(bins);
  // One receiver of each slot is enough for strong echoes.
  for (int k = 0; k < stack.channels(); k += stack.receivers) {
    int last = -2;
    for (int f = 0; f < stack.frames; ++f) {
      const std::size_t at = stack.at(f * stack.loops, k, 0);
      const auto use = stack.use.begin() + static_cast<long>(at);
      if (std::count(use, use + stack.samples, std::uint8_t{0}) > stack.samples / 10) continue;
      for (std::size_t n = 0; n < bins; ++n) in[n] = stack.x[at + n] * window_[n];
      std::swap(now, before);
      fft().fwd(now.data(), in.data(), stack.samples);
      if (last == f - 1) {
        for (std::size_t b = 0; b < bins; ++b) {
          const std::complex<double> z(now[b] * std::conj(before[b]));
          if (std::abs(z) > 0) steps[b].push_back(z / std::abs(z));
        }
      }
      last = f;
    }
  }
  // The median of angles about their mean direction leaves out the two steps that a burst spoils.
  struct Turn {
    double rad, error_rad;
  };
  const auto middle = [](const std::vector<std::complex<double>>& turns) {
    const std::complex<double> sum = std::accumulate(turns.begin(), turns.end(), std::complex<double>(0));
    std::vector<double> angles;
    for (const auto& z : turns) angles.push_back(std::arg(z * std::conj(sum)));
    const double beside = medianOfCopy(angles);
    return Turn{std::arg(sum) + beside, errorOfMedian(angles, beside)};
  };
  std::vector<Turn> of_bins;
  std::vector<std::complex<double>> each;
  for (const auto& of_bin : steps) {
    // Half of the steps may have any phase. Forty steps of noise sum to a sixth of their number.
    const std::complex<double> sum = std::accumulate(of_bin.begin(), of_bin.end(), std::complex<double>(0));
    if (!(std::abs(sum) > 0.5 * static_cast<double>(of_bin.size()))) continue;
    of_bins.push_back(middle(of_bin));
    each.push_back(std::polar(1.0, of_bins.back().rad));
  }
  if (of_bins.empty()) return 0;
  const Turn common = middle(each);
  // Most of these bins are weak. Bins are weighted by their errors, except for those that turn by themselves.
  std::vector<std::pair<double, double>> weighed;
  for (const Turn& t : of_bins) {
    const double apart = std::remainder(t.rad - common.rad, 2 * M_PI);
    const double variance = std::max(t.error_rad * t.error_rad, 1e-12);
    if (apart * apart > 16 * (variance + common.error_rad * common.error_rad)) continue;
    weighed.emplace_back(apart, 1 / variance);
  }
  return common.rad + weightedMedian(weighed);
}

void ShotExaminer::takeCommonGain(const FrameStack& stack, ResidualSpectra& spectra, ShotStatistics& result) const {
  spectra.gain.assign(spectra.shot.size(), 1);
  result.frame_level.assign(static_cast<std::size_t>(stack.frames), 1);
  const double freedom = static_cast<double>(spectra.shot.size()) - 1;
  if (freedom < 1) return;
  // The common gain is the weighted median over range bins: moving echoes fill few of them.
  struct Cell {
    int bin;
    double power;
  };
  const auto still = [&](int b) {
    return Eigen::Map<const Eigen::VectorXcf>(&spectra.average[static_cast<std::size_t>(b * spectra.channels)],
                                              spectra.channels);
  };
  const auto varied = [&](std::size_t i, int b) {
    return Eigen::Map<const Eigen::VectorXcf>(spectra.at(i, b), spectra.channels);
  };
  const auto beyondOne = [&](const std::vector<Cell>& cells) {
    std::vector<std::complex<double>> beyond;
    std::vector<std::pair<double, double>> re(cells.size()), im(cells.size());
    for (std::size_t i = 0; i < spectra.shot.size(); ++i) {
      for (std::size_t c = 0; c < cells.size(); ++c) {
        const std::complex<double> share =
            std::complex<double>(still(cells[c].bin).dot(varied(i, cells[c].bin))) / cells[c].power;
        re[c] = {share.real(), cells[c].power};
        im[c] = {share.imag(), cells[c].power};
      }
      beyond.emplace_back(weightedMedian(re), weightedMedian(im));
    }
    return beyond;
  };
  // Cells that vary by less than a tenth apart from the common gain.
  const auto steady = [&](const std::vector<std::complex<double>>& beyond) {
    std::vector<Cell> cells;
    for (int b = 0; b < spectra.bins; ++b) {
      double scatter = 0;
      for (std::size_t i = 0; i < spectra.shot.size(); ++i) {
        scatter += (varied(i, b) - Complex(beyond[i]) * still(b)).squaredNorm();
      }
      const double power = still(b).squaredNorm();
      if (power > 10 * scatter / freedom) cells.push_back({b, power});
    }
    return cells;
  };
  std::vector<Cell> cells = steady(std::vector<std::complex<double>>(spectra.shot.size(), 0.0)), all;
  // Where the gain changes by more than a tenth, cells are steady only relative to it.
  for (int b = 0; b < spectra.bins; ++b) {
    if (still(b).squaredNorm() > 0) all.push_back({b, still(b).squaredNorm()});
  }
  std::vector<Cell> beside = steady(beyondOne(all));
  if (beside.size() > cells.size()) cells = std::move(beside);
  if (cells.empty()) return;
  const std::vector<std::complex<double>> common = beyondOne(cells);
  for (std::size_t i = 0; i < spectra.shot.size(); ++i) {
    const std::complex<double> beyond = common[i];
    spectra.gain[i] = 1.0 + beyond;
    result.frame_level[static_cast<std::size_t>(spectra.shot[i] / spectra.per_frame)] = std::abs(spectra.gain[i]);
    Complex* e = spectra.at(i, 0);
    for (std::size_t j = 0; j < spectra.average.size(); ++j) e[j] -= Complex(beyond) * spectra.average[j];
  }
}

void ShotExaminer::takeLaws(const FrameStack& stack, ResidualSpectra& s, ShotStatistics& result) const {
  FrameLaws taken =
      takeFrameLaws(radar_, {s.channels, s.bins, stack.loops, stack.frames, s.shot, &s.gain, &s.average, &s.residual});
  result.laws = std::move(taken.laws);
  if (result.laws.empty()) return;
  std::fill(result.frame_level.begin(), result.frame_level.end(), 1.0);
  std::size_t at = 0;
  for (std::size_t i = 0; i < s.shot.size() && !taken.level_db.empty(); ++i) {
    const int frame = s.shot[i] / s.per_frame;
    if (i > 0 && s.shot[i - 1] / s.per_frame == frame) continue;
    result.frame_level[static_cast<std::size_t>(frame)] = std::pow(10, taken.level_db[at++] / 20);
  }
}

void ShotExaminer::readSteadiness(const ResidualSpectra& spectra, ShotStatistics& result) const {
  const double freedom = static_cast<double>(spectra.shot.size()) - 1;
  if (freedom < 4) return;
  std::vector<double> varied(static_cast<std::size_t>(spectra.bins), 0), standing(varied);
  for (int b = 0; b < spectra.bins; ++b) {
    const auto bin = static_cast<std::size_t>(b);
    for (std::size_t i = 0; i < spectra.shot.size(); ++i) {
      varied[bin] += Eigen::Map<const Eigen::VectorXcf>(spectra.at(i, b), spectra.channels).squaredNorm() / freedom;
    }
    standing[bin] = Eigen::Map<const Eigen::VectorXcf>(
                        &spectra.average[bin * static_cast<std::size_t>(spectra.channels)], spectra.channels)
                        .squaredNorm();
  }
  // Noise fills all bins alike: the steadiest bins hold only noise.
  std::vector<double> sorted = varied;
  std::sort(sorted.begin(), sorted.end());
  const double noise = sorted[sorted.size() / 10];
  double all = 0, unsteady = 0;
  for (std::size_t b = 0; b < varied.size(); ++b) {
    if (!(standing[b] > bounds::kLeastStandingOverNoise * noise)) continue;
    ++all;
    if (!(varied[b] > bounds::kLeastVariedOverNoise * noise &&
          varied[b] - noise > bounds::kLeastVariedShare * standing[b])) {
      continue;
    }
    ++unsteady;
    const double q = varied[b] / std::max(noise, 1e-30);
    result.unsteady_nats += freedom * spectra.channels * (q - 1 - std::log(q));
  }
  if (all > 0) result.unsteady_share = unsteady / all;
}

void ShotExaminer::readNoise(ResidualSpectra& spectra, ShotStatistics& result) const {
  double window_power = 0;
  for (float w : window_) window_power += w * w;
  const double freedom = static_cast<double>(spectra.shot.size()) - 1;
  // Moving echoes fill few range bins, noise fills all of them alike: the median over bins gives the noise. It is a
  // median of sums that follow a Gamma distribution with the number of shots (Wilson and Hilferty: median = mean (1 -
  // 1/(9 n))^3).
  const double median_of_mean = std::pow(1 - 1 / (9 * std::max(freedom, 1.0)), 3);
  result.noise_variance.assign(static_cast<std::size_t>(spectra.channels), 1.0 / 6);
  if (freedom < 1) return;
  for (int k = 0; k < spectra.channels; ++k) {
    std::vector<double> power(static_cast<std::size_t>(spectra.bins), 0);
    for (std::size_t i = 0; i < spectra.shot.size(); ++i) {
      for (int b = 0; b < spectra.bins; ++b) power[static_cast<std::size_t>(b)] += std::norm(spectra.at(i, b)[k]);
    }
    const double variance = medianOfCopy(power) / freedom / median_of_mean / window_power;
    result.noise_variance[static_cast<std::size_t>(k)] = std::max(variance, 1.0 / 6);
  }
  std::vector<float> scale;
  for (double v : result.noise_variance) scale.push_back(static_cast<float>(1 / std::sqrt(v * window_power)));
  for (std::size_t i = 0; i < spectra.residual.size(); ++i) spectra.residual[i] *= scale[i % scale.size()];
  for (std::size_t i = 0; i < spectra.average.size(); ++i) spectra.average[i] *= scale[i % scale.size()];
}

void ShotExaminer::readUnsteadiness(const ResidualSpectra& spectra, ShotStatistics& result) const {
  const double values = static_cast<double>(spectra.shot.size()) * spectra.channels,
               freedom = values - spectra.channels;
  // A changing radar changes all its echoes, which remain to be explained.
  if (freedom < 1 || result.unsteady_share > bounds::kLeastUnsteadyShare) return;
  for (int b = 0; b < spectra.bins; ++b) {
    double power = 0;
    for (std::size_t i = 0; i < spectra.shot.size(); ++i) {
      power += Eigen::Map<const Eigen::VectorXcf>(spectra.at(i, b), spectra.channels).squaredNorm();
    }
    const double beyond = power / freedom - 1;
    if (beyond < bounds::kLeastBinScatter_deviations / std::sqrt(freedom)) continue;
    result.unsteadiness.resize(static_cast<std::size_t>(spectra.bins), 1.0);
    result.unsteadiness[static_cast<std::size_t>(b)] += kAlike * beyond;
  }
}

void ShotExaminer::readEvidence(const ResidualSpectra& spectra, ShotStatistics& result) const {
  result.evidence = Eigen::ArrayXXf::Zero(spectra.bins, kAngleBins);
  const double freedom = static_cast<double>(spectra.shot.size()) - 1;
  if (freedom < 4) return;
  Eigen::ArrayXXf ratio(spectra.bins, kAngleBins);
  for (int b = 0; b < spectra.bins; ++b) {
    Eigen::MatrixXcf c = Eigen::MatrixXcf::Zero(spectra.channels, spectra.channels);
    for (std::size_t i = 0; i < spectra.shot.size(); ++i) {
      const Eigen::Map<const Eigen::VectorXcf> e(spectra.at(i, b), spectra.channels);
      c.noalias() += e * e.adjoint();
    }
    c /= static_cast<float>(freedom);
    const Eigen::Map<const Eigen::VectorXcf> still(&spectra.average[static_cast<std::size_t>(b * spectra.channels)],
                                                   spectra.channels);
    // Flicker of a static echo (phase noise, gain) has the echo's channel vector and some permille of its power. That
    // direction is left out where it varies by so little; a body that stands and breathes varies by more.
    const float standing = still.squaredNorm();
    Eigen::MatrixXcf beams = beams_;
    if (c.trace().real() < 0.01f * standing) {
      beams -= still * (still.adjoint() * beams_) / standing;
    }
    const Eigen::MatrixXcf varied = c * beams;
    // Laws of the frames are taken out up to a remainder.
    const float remainder = result.laws.empty() ? 0 : kRemainderOfLaws;
    for (int a = 0; a < kAngleBins; ++a) {
      const float size = beams.col(a).squaredNorm();
      ratio(b, a) =
          size > 0.2f * static_cast<float>(spectra.channels)
              ? (beams.col(a).dot(varied.col(a)).real() - remainder * std::norm(beams.col(a).dot(still))) / size
              : 1.0f;
    }
  }
  // Skirts of strong echoes reach over many bins. A moving echo also exceeds its surroundings in range.
  std::vector<float> around;
  for (int a = 0; a < kAngleBins; ++a) {
    for (int b = 0; b < spectra.bins; ++b) {
      if (ratio(b, a) <= 1) continue;
      around.clear();
      for (int d = -kSkirtBins; d <= kSkirtBins; ++d) {
        if (std::abs(d) > kPeakBins && b + d >= 0 && b + d < spectra.bins) around.push_back(ratio(b + d, a));
      }
      const double q = ratio(b, a) / std::max(1.0f, medianOfCopy(around));
      if (q > 1) result.evidence(b, a) = static_cast<float>(freedom * (q - 1 - std::log(q)));
    }
  }
}

void ShotExaminer::readEchoes(const ResidualSpectra& spectra, ShotStatistics& result) const {
  // A bin holds M times the noise, over all channels.
  const auto least = static_cast<float>(
      boost::math::gamma_q_inv(static_cast<double>(spectra.channels), bounds::kMovingBinFalseAlarmRate));
  std::vector<float> power(static_cast<std::size_t>(spectra.bins));
  Eigen::VectorXf beam(kAngleBins);
  for (std::size_t i = 0; i < spectra.shot.size(); ++i) {
    std::vector<MovingEcho> echoes;
    for (int b = 0; b < spectra.bins; ++b) {
      power[static_cast<std::size_t>(b)] =
          Eigen::Map<const Eigen::VectorXcf>(spectra.at(i, b), spectra.channels).squaredNorm();
    }
    for (int b = 1; b + 1 < spectra.bins; ++b) {
      const float here = power[static_cast<std::size_t>(b)];
      const float left = power[static_cast<std::size_t>(b - 1)], right = power[static_cast<std::size_t>(b + 1)];
      if (here < least || here < left || here <= right) continue;
      beam = (beams_.adjoint() * Eigen::Map<const Eigen::VectorXcf>(spectra.at(i, b), spectra.channels)).cwiseAbs2();
      int a = 0;
      const float peak = beam.maxCoeff(&a);
      MovingEcho echo;
      echo.frame = spectra.shot[i] / spectra.per_frame;
      echo.range_m = (b + peakOffset(left, here, right)) * radar_.range_bin_m();
      echo.azimuth_rad = azimuth_rad(beam, a);
      echo.snr = peak / spectra.channels;
      echo.radial_m_per_s = std::numeric_limits<double>::quiet_NaN();
      echoes.push_back(echo);
    }
    std::sort(echoes.begin(), echoes.end(), [](const auto& p, const auto& q) { return p.snr > q.snr; });
    if (echoes.size() > kEchoesPerFrame) echoes.resize(kEchoesPerFrame);
    result.echoes.insert(result.echoes.end(), echoes.begin(), echoes.end());
  }
}

void ShotExaminer::readTurn(const FrameStack& stack, const ResidualSpectra& spectra, ShotStatistics& result) const {
  result.turn_variance = std::numeric_limits<double>::infinity();
  const double shots = static_cast<double>(spectra.shot.size());
  if (stack.frames < 3 || spectra.shot.size() < 3) return;
  std::vector<double> frame;
  double mean_frame = 0;
  for (int shot : spectra.shot) frame.push_back(shot / stack.loops);
  for (double f : frame) mean_frame += f / shots;
  double spread = 0;
  for (double f : frame) spread += (f - mean_frame) * (f - mean_frame);
  if (!(spread > 0)) return;
  // The phase drift is the mean slope of phases over every second bin (a Hann window correlates neighbours), weighted
  // by each bin's own scatter: a bin with motion has little weight.
  double weights = 0, weighted = 0, squares = 0, moments = 0;
  for (int b = 0; b < spectra.bins; b += 2) {
    const Eigen::Map<const Eigen::VectorXcf> still(&spectra.average[static_cast<std::size_t>(b * spectra.channels)],
                                                   spectra.channels);
    const double power = still.squaredNorm();
    // The average has noise of channels/shots.
    if (power < 10 * spectra.channels / shots || power < 10) continue;
    std::vector<double> phase;
    double mean = 0, slope = 0;
    for (std::size_t i = 0; i < spectra.shot.size(); ++i) {
      const Eigen::Map<const Eigen::VectorXcf> e(spectra.at(i, b), spectra.channels);
      phase.push_back(std::arg(spectra.gain[i] + std::complex<double>(still.dot(e)) / power));
      mean += phase.back() / shots;
    }
    for (std::size_t i = 0; i < phase.size(); ++i) slope += phase[i] * (frame[i] - mean_frame) / spread;
    double misfit = 0;
    for (std::size_t i = 0; i < phase.size(); ++i) {
      const double r = phase[i] - mean - slope * (frame[i] - mean_frame);
      misfit += r * r;
    }
    const double variance = std::max(misfit / (shots - 2), 0.5 / power) / spread;
    weights += 1 / variance;
    weighted += slope / variance;
    moments += slope * slope / variance;
    squares += 1 / (variance * variance);
    ++result.turn_cells;
  }
  if (result.turn_cells == 0) return;
  result.turn_rad_per_frame = weighted / weights;
  // Cells that disagree beyond their scatter increase the error (Birge).
  const double chi2 = moments - weighted * weighted / weights;
  const double ratio = result.turn_cells > 1 ? std::max(1.0, chi2 / (result.turn_cells - 1)) : 1.0;
  result.turn_variance = ratio / weights;
  result.turn_cells = static_cast<int>(std::lround(weights * weights / squares));
}

ShotStatistics ShotExaminer::examine(const FrameStack& stack, const std::vector<Complex>& average) const {
  ShotStatistics result;
  ResidualSpectra s = spectra(stack, average);
  takeCommonGain(stack, s, result);
  // Before laws are taken: what they leave of a radar that changes looks like walkers and bursts.
  readSteadiness(s, result);
  takeLaws(stack, s, result);
  result.shots = static_cast<int>(s.shot.size());
  readNoise(s, result);
  readTurn(stack, s, result);
  for (const FrameLaw& law : result.laws) {
    // A slope through phases that scatter together is theirs, not that of the cells alone.
    const double far = law.kind == FrameLawKind::kPhaseRange ? radar_.max_range_m() : 1;
    if (!law.common || law.kind == FrameLawKind::kLevel) continue;
    result.turn_rad_per_frame += law.slope;
    result.turn_variance += slopeVariance(law.rms * far, law.frames);
  }
  readUnsteadiness(s, result);
  readEvidence(s, result);
  result.tracks = trackWalkers(
      radar_, {s.channels, s.bins, stack.loops, stack.frames, s.shot, &s.residual, &s.average, !result.laws.empty()});
  if (stack.loops >= kLeastLoops) {
    readDopplerEchoes(s, result);
  } else {
    readEchoes(s, result);
  }
  return result;
}

void ShotExaminer::readDopplerEchoes(const ResidualSpectra& s, ShotStatistics& result) const {
  DopplerFrame frame(s.channels, s.bins, s.per_frame);
  for (std::size_t begin = 0; begin < s.shot.size();) {
    const int number = s.shot[begin] / s.per_frame;
    std::size_t end = begin;
    while (end < s.shot.size() && s.shot[end] / s.per_frame == number) ++end;
    frame.transform(s, begin, end);
    begin = end;
    std::vector<MovingEcho> echoes;
    std::vector<MovingCell> cells;
    for (DopplerCell peak : frame.movingPeaks()) {
      if (!unwrap(result.tracks, number, peak)) continue;
      cells.push_back(movingCell(frame, peak, result.noise_variance));
      if (std::optional<MovingEcho> echo = dopplerEcho(frame, peak)) {
        echo->frame = number;
        echoes.push_back(*echo);
      }
    }
    double strongest = 0;
    for (const MovingCell& c : cells) strongest = std::max(strongest, c.power);
    for (MovingCell& c : cells) {
      if (c.power > bounds::kLeastShareOfStrongestCell * strongest) result.cells.push_back(std::move(c));
    }
    const std::vector<MovingEcho> bodies = bodiesOf(std::move(echoes));
    result.echoes.insert(result.echoes.end(), bodies.begin(), bodies.end());
  }
}

bool ShotExaminer::unwrap(const std::vector<WalkTrack>& tracks, int frame, DopplerCell& peak) const {
  const double frame_s = frame * radar_.frame_period_s, bin_m = radar_.range_bin_m();
  const double per_turn_m_per_s =
      0.5 * radar_.wavelength_m() / (radar_.loops_per_frame * radar_.slots() * chirpPeriod_s(radar_));
  for (const WalkTrack& t : tracks) {
    if (frame < t.first_frame || frame > t.last_frame) continue;
    if (std::abs(t.at(frame_s)[0] - peak.bin * bin_m) > 2 * bin_m) continue;
    if (!t.radial) return false;
    const double whole = (t.radial->value / per_turn_m_per_s - peak.turns) / radar_.loops_per_frame;
    peak.turns += radar_.loops_per_frame * static_cast<int>(std::lround(whole));
    return true;
  }
  return true;
}

MovingCell ShotExaminer::movingCell(const DopplerFrame& frame, const DopplerCell& peak,
                                    const std::vector<double>& noise_variance) const {
  MovingCell moving;
  moving.bin = peak.bin;
  moving.turn_rad = 2 * M_PI * peak.turns / (frame.loops() * radar_.slots());
  moving.power = frame.power(peak.bin, peak.doppler) / static_cast<double>(radar_.channels());
  moving.channels = frame.cell(peak.bin, peak.doppler).cast<std::complex<double>>();
  for (int k = 0; k < radar_.channels(); ++k) {
    moving.channels[k] *= std::sqrt(noise_variance[static_cast<std::size_t>(k)]);
  }
  return moving;
}

std::optional<MovingEcho> ShotExaminer::dopplerEcho(const DopplerFrame& frame, const DopplerCell& peak) const {
  const int loops = frame.loops(), channels = radar_.channels(), b = peak.bin, d = peak.doppler;
  Eigen::VectorXcf v = frame.cell(b, d);
  // Later slots see a moving echo further on its way.
  for (int k = 0; k < channels; ++k) {
    const int slot = k / radar_.receivers();
    v[k] *= Complex(std::polar(1.0, -2 * M_PI * peak.turns * slot / (loops * radar_.slots())));
  }
  const Eigen::VectorXf beam = (beams_.adjoint() * v).cwiseAbs2();
  int a = 0;
  const float strongest = beam.maxCoeff(&a);
  if (strongest < static_cast<float>(bounds::kLeastShareOfOneBeam) * static_cast<float>(channels) * frame.power(b, d)) {
    return std::nullopt;
  }
  const double turn_offset =
      peakOffset(frame.power(b, (d + loops - 1) % loops), frame.power(b, d), frame.power(b, (d + 1) % loops));
  const double per_turn_m_per_s = 0.5 * radar_.wavelength_m() / (loops * radar_.slots() * chirpPeriod_s(radar_));
  MovingEcho echo;
  echo.range_m =
      (b + peakOffset(frame.power(b - 1, d), frame.power(b, d), frame.power(b + 1, d))) * radar_.range_bin_m();
  echo.azimuth_rad = azimuth_rad(beam, a);
  echo.snr = strongest / static_cast<float>(channels);
  echo.radial_m_per_s = (peak.turns + turn_offset) * per_turn_m_per_s;
  return echo;
}

}  // namespace mmradartwin::diagnosis::frames
