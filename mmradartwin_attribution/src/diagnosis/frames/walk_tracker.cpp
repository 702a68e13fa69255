#include "diagnosis/frames/walk_tracker.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_dsp/chirp_period.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::frames {
namespace {

using Complex = std::complex<float>;

constexpr int kLeastLoopsOfTracks = 8;        ///< loops that tell a walker's phase slope within a frame
constexpr int kFewestFramesOfWays = 16;       ///< that show a walk through range bins without loops
constexpr int kFewestFramesOfTrack = 4;       ///< of a recording that has twice as many
constexpr double kLongWay_m = 1.0;            ///< of such a walk; a shorter one is found about its place
constexpr double kFastest_m_per_s = 8;        ///< of a person who runs
constexpr double kMostAcross_m_per_s = 3;     ///< with which the search across the view begins
constexpr int kBeams = 32;                    ///< of the search, over all sines
constexpr int kMostTracks = 8;                ///< of a pose
constexpr int kFramesOfSearch = 64;           ///< through which a walk is straight enough to be found
constexpr double kUsualPower = 14;            ///< which the best of a frame's cells rarely reaches by noise
constexpr int kResponseBins = 2;              ///< half the width of Hann's response in range
constexpr int kWideBins = 8;                  ///< the same down to the last sidelobes that matter
constexpr double kApart_bins = 3;             ///< between two walkers in one frame
constexpr double kSidelobeShare = 0.003;      ///< of a walker's power, down to which window and array leave sidelobes
constexpr double kGlint_m = 0.03;             ///< standard error of the place that a body's echo comes from, by frames
constexpr double kSpeedError_m_per_s = 0.02;  ///< standard error of a body that is no point
constexpr double kDrop95 = 1.92;              ///< nats below the highest likelihood that bound a 95 % interval
constexpr double kAsLikely = 5;               ///< nats by which another speed has to be less likely to be ruled out
constexpr double kLeastNatsOfMotion = 20;     ///< over something that stands and changes
constexpr double kHannCorrelation = 1.94;     ///< by which neighbouring bins of a Hann window say the same twice
constexpr int kMostSearches = 16;             ///< of a window
constexpr double kBody_m = 0.5;               ///< least distance of two walkers in one frame
constexpr double kLeastEnd = 0.15;            ///< share of a walker's usual power in the first and last frame of a run
constexpr double kFlicker = 1e-3;             ///< share of its power, by which what stands may flicker
constexpr double kFlickerOfLaws = 1e-2;       ///< the same where a law of frames was taken out
constexpr double kRidge = 1e-3;               ///< share of a standing echo that frames can never tell

/// Straight walk in the plane: range and sine of azimuth at a reference time, speeds along and across the view there.
struct Path {
  double range_m = 1, azimuth_rad = 0, radial_m_per_s = 0, across_m_per_s = 0;
};

/// Where a path is at one time.
struct Moment {
  double range_m, sine, radial_m_per_s;
};

Moment momentOf(const Path& p, double since_s) {
  const double along = p.range_m + p.radial_m_per_s * since_s, across = p.across_m_per_s * since_s;
  const double range_m = std::max(1e-3, std::hypot(along, across));
  const double azimuth = p.azimuth_rad + std::atan2(across, along);
  return {range_m, std::sin(azimuth), (p.radial_m_per_s * along + p.across_m_per_s * across) / range_m};
}

/// Fit of a path to frames.
struct Fit {
  double power = 0;            ///< that the path explains, in units of the noise: nats
  double per_value = 0;        ///< of what is left in the cells about it, 1 for noise
  Eigen::VectorXcd amplitude;  ///< [frame of the run]
  std::vector<double> snr;     ///< [frame of the run]
};

/// Run of successive frames.
struct Run {
  int first = 0, last = -1;
  int size() const { return last - first + 1; }
};

class Tracker {
 public:
  Tracker(const RadarConfig& radar, const ShotSpectra& s)
      : radar_(radar), s_(s), x_(*s.values), begin_(static_cast<std::size_t>(s.frames) + 1, 0) {
    for (int f = 0; f <= s.frames; ++f) {
      begin_[static_cast<std::size_t>(f)] =
          static_cast<std::size_t>(std::lower_bound(s.shot.begin(), s.shot.end(), f * s.loops) - s.shot.begin());
    }
    loop_s_ = radar.slots() * chirpPeriod_s(radar);
    per_m_ = 4 * M_PI / radar.wavelength_m();
    for (int k = 0; k < s.channels; ++k) {
      element_m_.push_back(radar.virtual_element_m(k).y());
      slot_s_.push_back(k / radar.receivers() * chirpPeriod_s(radar));
    }
    makeResponse();
  }

  std::vector<WalkTrack> run() {
    std::vector<WalkTrack> tracks;
    makeTrials();
    for (int first = 0; first < s_.frames; first += kFramesOfSearch) {
      const Run window{first, std::min(s_.frames, first + kFramesOfSearch) - 1};
      if (window.size() < 2) continue;
      spent_.assign(static_cast<std::size_t>(window.size()), standing());
      for (int search = 0; search < kMostSearches && tracks.size() < kMostTracks; ++search) {
        readCells(window);
        std::optional<WalkTrack> track = next(window);
        if (!track) break;
        if (track->nats > 0) tracks.push_back(std::move(*track));
      }
    }
    std::stable_sort(tracks.begin(), tracks.end(), [](const auto& a, const auto& b) { return a.nats > b.nats; });
    return tracks;
  }

 private:
  double frame_s(int frame) const { return frame * radar_.frame_period_s; }

  /// Response of Hann's window [32 steps a bin], complex about its own bin, over distances of bins.
  void makeResponse() {
    const std::vector<double> window = hannWindow(s_.bins);
    double squares = 0;
    for (double w : window) squares += w * w;
    for (int step = -kSteps * kWideBins; step <= kSteps * kWideBins; ++step) {
      std::complex<double> sum = 0;
      const double bins = static_cast<double>(step) / kSteps;
      // Referred to the window's centre, where the phase of a path is that of its length.
      for (int n = 0; n < s_.bins; ++n) {
        sum += window[static_cast<std::size_t>(n)] * std::polar(1.0, 2 * M_PI * bins * (n - 0.5 * s_.bins) / s_.bins);
      }
      response_.push_back(sum.real() / std::sqrt(squares));
    }
  }
  /// Amplitude in a bin of an echo `bins` before it; alternates in sign from bin to bin.
  double response(int bin, double at) const {
    const double step = (at - bin) * kSteps + kSteps * kWideBins;
    const int low = static_cast<int>(std::floor(step));
    if (low < 0 || low + 1 >= static_cast<int>(response_.size())) return 0;
    const double share = step - low;
    const double value =
        (1 - share) * response_[static_cast<std::size_t>(low)] + share * response_[static_cast<std::size_t>(low + 1)];
    return bin % 2 ? -value : value;
  }

  /// Speeds of the search: half a Doppler bin apart.
  void makeTrials() {
    const double step = 0.25 * radar_.wavelength_m() / (s_.loops * loop_s_);
    const int side = std::clamp(static_cast<int>(std::ceil(kFastest_m_per_s / step)), 1, 400);
    step_m_per_s_ = kFastest_m_per_s / side;
    trials_ = 2 * side + 1;
  }
  double trial_m_per_s(int j) const { return (j - trials_ / 2) * step_m_per_s_; }

  /// Highest power over directions of every speed and bin, frame by frame.
  void readCells(const Run& window) {
    level_.resize(static_cast<std::size_t>(window.size()));
    Eigen::MatrixXcf beams(s_.channels, kBeams);
    for (int a = 0; a < kBeams; ++a) {
      for (int k = 0; k < s_.channels; ++k) {
        // All phases that a uniform line of channels can have.
        beams(k, a) = Complex(std::polar(1.0, -2 * M_PI * k * (a - kBeams / 2) / kBeams));
      }
    }
    for (int f = window.first; f <= window.last; ++f) {
      Eigen::ArrayXXf& level = level_[static_cast<std::size_t>(f - window.first)];
      level = Eigen::ArrayXXf::Zero(trials_, s_.bins);
      const std::size_t from = begin_[static_cast<std::size_t>(f)], to = begin_[static_cast<std::size_t>(f) + 1];
      if (from == to) continue;
      Eigen::MatrixXcf y(s_.channels, s_.bins);
      for (int j = 0; j < trials_; ++j) {
        y.setZero();
        const double turn = per_m_ * trial_m_per_s(j);
        for (std::size_t i = from; i < to; ++i) {
          const auto back = Complex(std::polar(1.0, -turn * loop_s_ * (s_.shot[i] % s_.loops)));
          y += back * shot(i);
        }
        for (int k = 0; k < s_.channels; ++k) {
          y.row(k) *= Complex(std::polar(1.0, -turn * slot_s_[static_cast<std::size_t>(k)]));
        }
        const float scale = 1.0f / static_cast<float>(s_.channels * static_cast<double>(to - from));
        level.row(j) = (1 + scale * (beams.adjoint() * y).cwiseAbs2().array().colwise().maxCoeff()).log();
      }
    }
  }
  Eigen::Map<const Eigen::MatrixXcf> shot(std::size_t i) const {
    return Eigen::Map<const Eigen::MatrixXcf>(
        &x_[i * static_cast<std::size_t>(s_.bins) * static_cast<std::size_t>(s_.channels)], s_.channels, s_.bins);
  }

  /// Level down to which what stands flickers, by the bin: log(1 + power over noise) of a frame.
  Eigen::ArrayXf standing() const {
    const double share = s_.has_laws ? kFlickerOfLaws : kFlicker;
    Eigen::ArrayXf level(s_.bins);
    for (int b = 0; b < s_.bins; ++b) {
      double power = 0;
      for (int k = 0; k < s_.channels; ++k) {
        power += std::norm((*s_.average)[static_cast<std::size_t>(b * s_.channels + k)]);
      }
      level[b] = static_cast<float>(std::log(1 + share * power * s_.loops));
    }
    return level;
  }

  /// Straight line in range with the run of frames that hold it.
  struct Line {
    double range_m = 0, radial_m_per_s = 0, score = 0;  ///< range at the middle of the window
    Run run;
  };

  /// Best line of the cells of a window.
  Line strongestLine(const Run& window) const {
    const double bin_m = radar_.range_bin_m(), duration_s = (window.size() - 1) * radar_.frame_period_s;
    const double middle_s = 0.5 * (frame_s(window.first) + frame_s(window.last));
    const double step = std::min(0.5 * step_m_per_s_, 0.5 * bin_m / duration_s);
    const double fastest = s_.loops < kLeastLoopsOfTracks ? kMostAcross_m_per_s : kFastest_m_per_s;
    const int side = static_cast<int>(std::ceil(fastest / step));
    const auto usual = static_cast<float>(std::log(1 + kUsualPower));
    Line best;
    for (int i = -side; i <= side; ++i) {
      const double v = i * step, reach_m = 0.5 * duration_s * std::abs(v);
      const int trial = std::clamp(static_cast<int>(std::lround(v / step_m_per_s_)) + trials_ / 2, 0, trials_ - 1);
      for (double r = -reach_m; r < s_.bins * bin_m + reach_m; r += 0.5 * bin_m) {
        double sum = 0;
        int first = window.first;
        for (int f = window.first; f <= window.last; ++f) {
          const int bin = static_cast<int>(std::lround((r + v * (frame_s(f) - middle_s)) / bin_m));
          const bool inside = bin >= 1 && bin + 1 < s_.bins;
          const auto at = static_cast<std::size_t>(f - window.first);
          const bool counts = inside && level_[at](trial, bin) > spent_[at][bin];
          sum += counts ? level_[at](trial, bin) - usual : -usual;
          if (sum <= 0) {
            sum = 0;
            first = f + 1;
          } else if (sum > best.score) {
            best = {r, v, sum, {first, f}};
          }
        }
      }
    }
    best.range_m += best.radial_m_per_s * (0.5 * (frame_s(best.run.first) + frame_s(best.run.last)) - middle_s);
    return best;
  }

  /// Cells that a walker fills hold no other one; sidelobes, and echoes over a wall, which come later, are none.
  void spend(const Run& window, const Path& path, const Run& run, double middle_s, const std::vector<double>& snr) {
    for (int f = std::max(window.first, run.first); f <= std::min(window.last, run.last); ++f) {
      const Moment m = momentOf(path, frame_s(f) - middle_s);
      Eigen::ArrayXf& spent = spent_[static_cast<std::size_t>(f - window.first)];
      const double at = m.range_m / radar_.range_bin_m(), power = snr[static_cast<std::size_t>(f - run.first)];
      for (int b = 0; b < s_.bins; ++b) {
        const bool near = std::abs(b - at) < std::max(kApart_bins, kBody_m / radar_.range_bin_m());
        const double share = near ? 1e6 : b > at ? bounds::kMostGhostShare : kSidelobeShare;
        spent[b] = std::max(spent[b], static_cast<float>(std::log(1 + share * power)));
      }
    }
  }

  /// Takes a walker out of the shots, with the share of it that stood in their mean.
  void subtract(const Path& path, const Run& run, double middle_s, const Fit& fit) {
    const std::vector<std::complex<double>> channels = channelsOf(path, run, middle_s, fit);
    for (int f = run.first; f <= run.last; ++f) {
      const Moment m = momentOf(path, frame_s(f) - middle_s);
      const double at = m.range_m / radar_.range_bin_m(), turn = per_m_ * m.radial_m_per_s;
      const std::complex<double> amplitude = fit.amplitude[f - run.first];
      const int low = std::max(0, static_cast<int>(std::ceil(at - kWideBins))),
                high = std::min(s_.bins - 1, static_cast<int>(std::floor(at + kWideBins)));
      for (std::size_t n = begin_[static_cast<std::size_t>(f)]; n < begin_[static_cast<std::size_t>(f) + 1]; ++n) {
        const auto now = amplitude * std::polar(1.0, turn * loop_s_ * (s_.shot[n] % s_.loops));
        for (int b = low; b <= high; ++b) {
          Complex* x = &x_[(n * static_cast<std::size_t>(s_.bins) + static_cast<std::size_t>(b)) *
                           static_cast<std::size_t>(s_.channels)];
          const std::complex<double> here = now * response(b, at);
          for (int k = 0; k < s_.channels; ++k) {
            const auto i = static_cast<std::size_t>(k);
            x[k] -= Complex(here * channels[i] * steering(i, m));
          }
        }
      }
    }
    removeMean();
  }

  std::complex<double> steering(std::size_t channel, const Moment& m) const {
    return std::polar(1.0, per_m_ * (m.radial_m_per_s * slot_s_[channel] - 0.5 * element_m_[channel] * m.sine));
  }

  /// Each channel's factor about the array's response: what its own errors do to a walker.
  std::vector<std::complex<double>> channelsOf(const Path& path, const Run& run, double middle_s,
                                               const Fit& fit) const {
    std::vector<std::complex<double>> sum(static_cast<std::size_t>(s_.channels), 0);
    std::complex<double> mean = 0;
    for (int f = run.first; f <= run.last; ++f) {
      const Moment m = momentOf(path, frame_s(f) - middle_s);
      const double at = m.range_m / radar_.range_bin_m(), turn = per_m_ * m.radial_m_per_s;
      const int bin = std::clamp(static_cast<int>(std::lround(at)), 0, s_.bins - 1);
      for (std::size_t n = begin_[static_cast<std::size_t>(f)]; n < begin_[static_cast<std::size_t>(f) + 1]; ++n) {
        const auto back = std::conj(fit.amplitude[f - run.first] * response(bin, at)) *
                          std::polar(1.0, -turn * loop_s_ * (s_.shot[n] % s_.loops));
        for (int k = 0; k < s_.channels; ++k) {
          const auto i = static_cast<std::size_t>(k);
          sum[i] += back * std::conj(steering(i, m)) * std::complex<double>(shot(n)(k, bin));
        }
      }
    }
    for (const auto& v : sum) mean += v / static_cast<double>(s_.channels);
    for (auto& v : sum) v = std::abs(mean) > 0 ? v / mean : 1.0;
    return sum;
  }

  void removeMean() {
    Eigen::MatrixXcf mean = Eigen::MatrixXcf::Zero(s_.channels, s_.bins);
    for (std::size_t n = 0; n < s_.shot.size(); ++n) mean += shot(n);
    mean /= static_cast<float>(s_.shot.size());
    const auto values = static_cast<std::size_t>(mean.size());
    for (std::size_t n = 0; n < s_.shot.size(); ++n) {
      for (std::size_t i = 0; i < values; ++i) x_[n * values + i] -= mean.data()[i];
    }
  }

  /// True where two frames have a cell that is neither noise nor flicker.
  bool exceedsNoise() const {
    int frames = 0;
    for (std::size_t f = 0; f < level_.size(); ++f) {
      bool exceeds = false;
      for (int b = 1; b + 1 < s_.bins && !exceeds; ++b) {
        const float most = level_[f].col(b).maxCoeff();
        exceeds = most > spent_[f][b] && most > std::log(1 + kUsualPower);
      }
      frames += exceeds;
    }
    return frames >= 2;
  }

  /// Next walker of a window; nats are 0 where what was found stands. Nothing where only noise is left.
  std::optional<WalkTrack> next(const Run& window) {
    if (!exceedsNoise()) return std::nullopt;
    Line line = strongestLine(window);
    if (line.run.size() < 2 || line.score < kLeastScore) return std::nullopt;
    Run run = line.run;
    double middle_s = 0.5 * (frame_s(run.first) + frame_s(run.last));
    Path path{line.range_m, 0, line.radial_m_per_s, 0};
    path.azimuth_rad = directionOf(path, run, middle_s);
    path.across_m_per_s = acrossOf(path, run, middle_s);
    const double power = improve(path, run, middle_s);
    // The first direction came with a rough speed, which passes for one between slots.
    Path other = path;
    other.azimuth_rad = directionOf(path, run, middle_s);
    if (improve(other, run, middle_s) > power) path = other;
    Fit fit = fitOf(path, run, middle_s);
    if (const Run kept = keptOf(run, fit.snr); kept.size() < run.size()) {
      const double moved_s = 0.5 * (frame_s(kept.first) + frame_s(kept.last)) - middle_s;
      path = after(path, moved_s);
      middle_s += moved_s;
      run = kept;
      improve(path, run, middle_s);
      fit = fitOf(path, run, middle_s);
    }
    WalkTrack track;
    track.first_frame = run.first;
    track.last_frame = run.last;
    track.middle_s = middle_s;
    track.snr = fit.snr;
    spend(window, path, run, middle_s, fit.snr);
    const Path walked = judge(path, run, middle_s, fit, track);
    subtract(walked, run, middle_s, fitOf(walked, run, middle_s));
    // Where a walker crosses a strong echo, the gain of all cells errs for a moment.
    if (run.size() < kFewestFramesOfTrack && s_.frames >= 2 * kFewestFramesOfTrack) track.nats = 0;
    return track;
  }

  /// Run without frames at its ends that the path does not reach.
  static Run keptOf(Run run, const std::vector<double>& snr) {
    std::vector<double> sorted = snr;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<long>(sorted.size() / 2), sorted.end());
    const double least = kLeastEnd * sorted[sorted.size() / 2];
    const int offset = run.first;
    while (run.size() > 2 && snr[static_cast<std::size_t>(run.first - offset)] < least) ++run.first;
    while (run.size() > 2 && snr[static_cast<std::size_t>(run.last - offset)] < least) --run.last;
    return run;
  }

  /// The same path, told from another moment.
  static Path after(const Path& p, double since_s) {
    const Moment m = momentOf(p, since_s);
    const double along = p.range_m + p.radial_m_per_s * since_s, across = p.across_m_per_s * since_s;
    const double turned = std::atan2(across, along);
    return {m.range_m, p.azimuth_rad + turned, m.radial_m_per_s,
            p.across_m_per_s * std::cos(turned) - p.radial_m_per_s * std::sin(turned)};
  }

  /// Direction of highest power of a path over a run.
  double directionOf(Path path, const Run& run, double middle_s) const {
    double best = -1, azimuth = 0;
    for (int a = -30; a <= 30; ++a) {
      path.azimuth_rad = std::asin(a / 31.0);
      const double power = fitOf(path, run, middle_s).power;
      if (power > best) best = power, azimuth = path.azimuth_rad;
    }
    return azimuth;
  }

  /// Speed across the view of highest power, among those that people have.
  double acrossOf(Path path, const Run& run, double middle_s) const {
    const double step = std::max(resolution(path, run).across_m_per_s, kMostAcross_m_per_s / 40);
    double best = -1, across = 0;
    for (int i = -static_cast<int>(kMostAcross_m_per_s / step); i <= kMostAcross_m_per_s / step; ++i) {
      path.across_m_per_s = i * step;
      const double power = fitOf(path, run, middle_s).power;
      if (power > best) best = power, across = path.across_m_per_s;
    }
    return across;
  }

  /// What a path would put into a frame: bins from `low`, channels, and the sum of its turns over the loops.
  struct Template {
    int low = 0;
    Eigen::VectorXf bins;
    Eigen::VectorXcf channels;
    std::complex<double> turned = 0;
    double size = 0;  ///< squared
  };

  Template templateOf(int frame, const Moment& m) const {
    Template t;
    const double at = m.range_m / radar_.range_bin_m(), turn = per_m_ * m.radial_m_per_s;
    t.low = std::max(0, static_cast<int>(std::ceil(at - kResponseBins)));
    const int high = std::min(s_.bins - 1, static_cast<int>(std::floor(at + kResponseBins)));
    if (high < t.low) return t;
    t.bins.resize(high - t.low + 1);
    for (int b = t.low; b <= high; ++b) t.bins[b - t.low] = static_cast<float>(response(b, at));
    t.channels.resize(s_.channels);
    for (int k = 0; k < s_.channels; ++k) t.channels[k] = Complex(steering(static_cast<std::size_t>(k), m));
    const std::size_t from = begin_[static_cast<std::size_t>(frame)], to = begin_[static_cast<std::size_t>(frame) + 1];
    for (std::size_t n = from; n < to; ++n) t.turned += std::polar(1.0, turn * loop_s_ * (s_.shot[n] % s_.loops));
    t.size = s_.channels * t.bins.squaredNorm() * static_cast<double>(to - from);
    return t;
  }

  /// Least squares of a path over a run: one complex amplitude a frame beside what stands, which was removed as the
  /// mean over all shots and so took a share of the walker with it.
  Fit fitOf(const Path& path, const Run& run, double middle_s) const {
    Fit fit;
    const int frames = run.size();
    Eigen::VectorXcd c = Eigen::VectorXcd::Zero(frames);
    std::vector<Template> all;
    double power = 0, values = 0;
    for (int i = 0; i < frames; ++i) {
      const int f = run.first + i;
      const Moment m = momentOf(path, frame_s(f) - middle_s);
      const Template& t = all.emplace_back(templateOf(f, m));
      if (!(t.size > 0)) continue;
      const Eigen::Index width = t.bins.size();
      for (std::size_t n = begin_[static_cast<std::size_t>(f)]; n < begin_[static_cast<std::size_t>(f) + 1]; ++n) {
        const auto back = std::polar(1.0, -per_m_ * m.radial_m_per_s * loop_s_ * (s_.shot[n] % s_.loops));
        const auto part = shot(n).middleCols(t.low, width);
        c[i] += back * std::complex<double>(t.channels.dot(part * t.bins));
        power += part.squaredNorm();
        values += static_cast<double>(width * s_.channels);
      }
    }
    solve(c, all, fit);
    fit.per_value = values > frames ? std::max(0.0, power - fit.power) / (values - frames) : 1;
    return fit;
  }

  /// Amplitudes and power of the normal equations, whose other elements come from the mean that was removed.
  void solve(const Eigen::VectorXcd& c, const std::vector<Template>& all, Fit& fit) const {
    const auto frames = static_cast<Eigen::Index>(all.size());
    Eigen::MatrixXcd g = Eigen::MatrixXcd::Zero(frames, frames);
    for (Eigen::Index i = 0; i < frames; ++i) {
      const Template& p = all[static_cast<std::size_t>(i)];
      g(i, i) = p.size > 0 ? p.size * (1 + kRidge) : 1;
      for (Eigen::Index j = 0; j <= i; ++j) {
        const Template& q = all[static_cast<std::size_t>(j)];
        const int low = std::max(p.low, q.low),
                  high = static_cast<int>(std::min(p.low + p.bins.size(), q.low + q.bins.size()));
        if (high <= low || !(p.size > 0) || !(q.size > 0)) continue;
        const double bins = p.bins.segment(low - p.low, high - low).dot(q.bins.segment(low - q.low, high - low));
        g(i, j) -= std::conj(p.turned) * q.turned * bins * std::complex<double>(p.channels.dot(q.channels)) /
                   static_cast<double>(s_.shot.size());
      }
    }
    fit.amplitude = g.selfadjointView<Eigen::Lower>().ldlt().solve(c);
    fit.power = c.dot(fit.amplitude).real();
    fit.snr.assign(static_cast<std::size_t>(frames), 0);
    for (Eigen::Index i = 0; i < frames; ++i) {
      const double size = all[static_cast<std::size_t>(i)].size;
      if (size > 0) fit.snr[static_cast<std::size_t>(i)] = std::norm(c[i]) / size;
    }
  }

  /// Scan step of each of a path's numbers: a fraction of what the recording resolves over a run.
  Path resolution(const Path& path, const Run& run) const {
    const double duration_s = std::max(1, run.size() - 1) * radar_.frame_period_s + s_.loops * loop_s_;
    Path step;
    step.range_m = 0.25 * radar_.range_bin_m();
    step.azimuth_rad = 0.25 * radar_.wavelength_m() / (radar_.channels() * radar_.virtual_pitch_m());
    step.radial_m_per_s = std::min(0.5 * step_m_per_s_, 0.5 * radar_.range_bin_m() / duration_s);
    step.across_m_per_s = path.range_m * step.azimuth_rad / duration_s;
    return step;
  }

  /// Highest power about a path, by coordinates with steps that shrink.
  double improve(Path& path, const Run& run, double middle_s, bool speed = true) const {
    Path step = resolution(path, run);
    const int passes = speed ? 7 : 3;
    double best = fitOf(path, run, middle_s).power;
    for (int pass = 0; pass < passes; ++pass) {
      double Path::*const numbers[] = {&Path::range_m, &Path::azimuth_rad, &Path::across_m_per_s,
                                       &Path::radial_m_per_s};
      for (double Path::*number : numbers) {
        if (!speed && number == &Path::radial_m_per_s) continue;
        climb(path, number, step.*number, run, middle_s, best);
      }
      for (double Path::*number : numbers) step.*number *= 0.5;
    }
    return best;
  }

  void climb(Path& path, double Path::*number, double step, const Run& run, double middle_s, double& best) const {
    for (int sense : {-1, 1}) {
      for (int moves = 0; moves < 6; ++moves) {
        Path next = path;
        next.*number += sense * step;
        if (std::abs(next.across_m_per_s) > kFastest_m_per_s || std::abs(next.azimuth_rad) > 1.5 || next.range_m < 0)
          break;
        const double power = fitOf(next, run, middle_s).power;
        if (power <= best) break;
        best = power;
        path = next;
      }
    }
  }

  /// Speeds with their likelihoods, and whether what moves does so.
  Path judge(Path path, const Run& run, double middle_s, const Fit& fit, WalkTrack& track) const;
  double across_error(const Path& path, const Run& run, double middle_s, const Fit& fit) const;
  std::vector<Path> otherSpeeds(const Path& path, const Run& run, double middle_s) const;

  static constexpr int kSteps = 32;
  static constexpr double kLeastScore = 6;  ///< nats of a line's run beyond noise

  const RadarConfig& radar_;
  const ShotSpectra& s_;
  std::vector<Complex> x_;          ///< as s_.values, without the walkers that were found
  std::vector<std::size_t> begin_;  ///< [frame] first shot
  double loop_s_ = 0, per_m_ = 0, step_m_per_s_ = 0;
  int trials_ = 0;
  std::vector<double> element_m_, slot_s_, response_;
  std::vector<Eigen::ArrayXf> spent_;   ///< [frame of the window] [bin] that of walkers found before
  std::vector<Eigen::ArrayXXf> level_;  ///< [frame of the window] [speed][bin] log(1 + power over noise)
};

double Tracker::across_error(const Path& path, const Run& run, double middle_s, const Fit& fit) const {
  const double step = resolution(path, run).across_m_per_s;
  Path left = path, right = path;
  left.across_m_per_s -= step;
  right.across_m_per_s += step;
  const double curve =
      (2 * fit.power - fitOf(left, run, middle_s).power - fitOf(right, run, middle_s).power) / (step * step);
  const double frames = run.size(), duration_s = (frames - 1) * radar_.frame_period_s;
  const double glint = kGlint_m * std::sqrt(12 / frames) / duration_s;
  return curve > 0 ? std::hypot(glint, std::sqrt(kHannCorrelation * std::max(1.0, fit.per_value) / curve))
                   : kFastest_m_per_s;
}

/// Paths whose phases from loop to loop are the same, up to whole turns.
std::vector<Path> Tracker::otherSpeeds(const Path& path, const Run& run, double middle_s) const {
  const double wrap_m_per_s = 0.5 * radar_.wavelength_m() / loop_s_;
  const int wraps = static_cast<int>(2 * kFastest_m_per_s / wrap_m_per_s);
  std::vector<Path> others;
  for (int wrap = -wraps; wrap <= wraps; ++wrap) {
    Path other = path;
    other.radial_m_per_s += wrap * wrap_m_per_s;
    if (wrap == 0 || std::abs(other.radial_m_per_s) > kFastest_m_per_s) continue;
    // The phase from slot to slot passes for a direction.
    double best = -1;
    Path kept = other;
    for (int beam = -31; beam <= 31; ++beam) {
      other.azimuth_rad = std::asin(beam / 32.0);
      const double here = fitOf(other, run, middle_s).power;
      if (here > best) best = here, kept = other;
    }
    others.push_back(kept);
  }
  return others;
}

Path Tracker::judge(Path path, const Run& run, double middle_s, const Fit& first, WalkTrack& track) const {
  const auto tell = [&](const Path& p) {
    track.range_m = p.range_m;
    track.azimuth_rad = p.azimuth_rad;
    track.radial_m_per_s = p.radial_m_per_s;
    track.across_m_per_s = p.across_m_per_s;
  };
  double best = first.power;
  std::vector<std::pair<double, Path>> peaks;
  for (Path other : otherSpeeds(path, run, middle_s)) {
    const double power = improve(other, run, middle_s);
    peaks.emplace_back(power, other);
    if (power > best) best = power, path = other;
  }
  const Fit fit = fitOf(path, run, middle_s);
  // What is left beside the path is what the model does not have: nats count by it.
  const double scale = kHannCorrelation * std::max(1.0, fit.per_value);
  tell(path);
  track.across_error_m_per_s = across_error(path, run, middle_s, fit);
  Path still = path;
  still.radial_m_per_s = still.across_m_per_s = 0;
  double stands = fitOf(still, run, middle_s).power;
  climb(still, &Path::range_m, resolution(path, run).range_m, run, middle_s, stands);
  climb(still, &Path::azimuth_rad, resolution(path, run).azimuth_rad, run, middle_s, stands);
  const double moves = (best - stands) / scale;
  track.nats = moves > kLeastNatsOfMotion ? best / scale : 0;
  const double step = resolution(path, run).radial_m_per_s;
  for (const auto& [power, other] : peaks) {
    if (std::abs(other.radial_m_per_s - path.radial_m_per_s) < 2 * step) continue;
    if ((best - power) / scale < kAsLikely) track.other_m_per_s.push_back(other.radial_m_per_s);
  }
  if (!track.other_m_per_s.empty()) return path;
  // The profile falls to either side of the likeliest speed.
  const auto bound = [&](int sense) {
    double inside = 0, outside = step / 64;
    Path at = path;
    const auto drop = [&](double apart) {
      Path p = at;
      p.radial_m_per_s = path.radial_m_per_s + sense * apart;
      const double power = improve(p, run, middle_s, false);
      return (best - power) / scale;
    };
    while (drop(outside) < kDrop95) {
      inside = outside;
      outside *= 2;
      if (outside > kFastest_m_per_s) return std::numeric_limits<double>::infinity();
    }
    for (int i = 0; i < 6; ++i) {
      const double middle = 0.5 * (inside + outside);
      (drop(middle) < kDrop95 ? inside : outside) = middle;
    }
    return outside;
  };
  const double below = bound(-1), above = bound(1), least = 1.96 * kSpeedError_m_per_s;
  if (!std::isfinite(below) || !std::isfinite(above)) return path;
  track.radial = Bounded{path.radial_m_per_s, path.radial_m_per_s - std::hypot(below, least),
                         path.radial_m_per_s + std::hypot(above, least)};
  return path;
}

}  // namespace

Eigen::Vector2d WalkTrack::at(double time_s) const {
  const double since_s = time_s - middle_s;
  const double along = range_m + radial_m_per_s * since_s, across = across_m_per_s * since_s;
  return {std::hypot(along, across), azimuth_rad + std::atan2(across, along)};
}

bool canTrackWalkers(const RadarConfig& radar, int frames) {
  return radar.loops_per_frame >= kLeastLoopsOfTracks && frames >= 2;
}

bool canTrackLongWays(int frames) { return frames >= kFewestFramesOfWays; }

std::vector<WalkTrack> trackWalkers(const RadarConfig& radar, const ShotSpectra& spectra) {
  const bool by_loops = canTrackWalkers(radar, spectra.frames);
  if (!by_loops && !canTrackLongWays(spectra.frames)) return {};
  if (spectra.shot.size() < static_cast<std::size_t>(kFewestFramesOfWays)) return {};
  std::vector<WalkTrack> tracks = Tracker(radar, spectra).run();
  if (by_loops) return tracks;
  // Without loops only the way through range bins shows a walk.
  const auto is_short = [&](const WalkTrack& t) {
    const double begin_m = t.at(t.first_frame * radar.frame_period_s)[0],
                 end_m = t.at(t.last_frame * radar.frame_period_s)[0];
    return std::abs(end_m - begin_m) < kLongWay_m || t.last_frame - t.first_frame < kFewestFramesOfWays / 2;
  };
  tracks.erase(std::remove_if(tracks.begin(), tracks.end(), is_short), tracks.end());
  return tracks;
}

}  // namespace mmradartwin::diagnosis::frames
