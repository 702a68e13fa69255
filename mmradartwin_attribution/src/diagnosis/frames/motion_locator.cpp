#include "diagnosis/frames/motion_locator.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>

#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin::diagnosis::frames {
namespace {

constexpr double kCell_m = 0.15;  // of the map: about a range bin of the paper's radar
// A walker and the width of a beam at some metres.
constexpr double kReach_m = 1.0;
constexpr std::size_t kMostWalkers = 4;
// A pose carries a finding from here on: chance makes one cell in 2e4.
constexpr float kPoseEvidence = 10;
// Evidence of one pose beyond this convinces no more: several poses that agree on a place weigh more than one alone.
constexpr float kConvincing = 50;
// Sidelobes of a window, and what a strong echo does to everything else, stay 20 dB below it.
constexpr float kBeside = 0.01f;
// Cells' noise is itself an estimate of some hundred values, good to a tenth: evidence counts less by so much.
constexpr double kTrust = 0.8;
// What poses share and a jackknife over them does not see: how often a walk turns, and frames in which its echo fades.
// Eight walks of 0.35 to 1.2 m/s came out between 19 % slow and 3 % fast.
constexpr double kWalkError = 0.07;  // of the speed, standard deviation
const double kLogFalseAlarm = std::log(1e-6);

struct Place {
  double x_m = 0, y_m = 0, evidence = 0;
};

float bounded(float evidence) { return evidence / (1 + evidence / kConvincing); }

double degrees(double rad) { return rad * 180 / M_PI; }

/// Logarithm of the chance that `poses` cells of pure noise add up to `evidence`: each holds half the square of the
/// positive part of a normal number, E exp(t e) = 1/2 + 1/2 (1 - t)^(-1/2); Chernoff's bound over t.
double logChance(double evidence, std::size_t poses) {
  double best = 0;
  for (double t = 0.02; t < 1; t += 0.02) {
    best = std::min(best, -t * evidence + static_cast<double>(poses) * std::log(0.5 + 0.5 / std::sqrt(1 - t)));
  }
  return best;
}

/// Cell of a place at a pose; false where the place is behind the radar or beyond its range.
class View {
 public:
  View(const RadarConfig& radar, const PoseMotion& pose)
      : R_(pose.pose.T_map_radar.linear().transpose()),
        p_(pose.pose.T_map_radar.translation()),
        per_bin_(1 / radar.range_bin_m()),
        per_sine_(2 * radar.virtual_pitch_m() / radar.wavelength_m() * (kAngleBins / 2)),
        bins_(static_cast<int>(pose.evidence.rows())) {}
  bool cell(double x_m, double y_m, int& bin, int& beam) const {
    // At the radar's height: an array along y tells no elevation.
    const Eigen::Vector3d d = R_ * Eigen::Vector3d(x_m - p_.x(), y_m - p_.y(), 0);
    const double r = d.norm();
    if (d.x() <= 0 || r < 1e-3) return false;
    bin = static_cast<int>(std::lround(r * per_bin_));
    beam = static_cast<int>(std::lround(d.y() / r * per_sine_)) + kAngleBins / 2;
    return bin < bins_ && beam >= 0 && beam < kAngleBins;
  }
  Eigen::Vector2d map(double range_m, double azimuth_rad) const {
    const Eigen::Vector3d d(range_m * std::cos(azimuth_rad), range_m * std::sin(azimuth_rad), 0);
    return (p_ + R_.transpose() * d).head<2>();
  }
  Eigen::Vector2d position() const { return p_.head<2>(); }

 private:
  Eigen::Matrix3d R_;
  Eigen::Vector3d p_;
  double per_bin_, per_sine_;
  int bins_;
};

class Search {
 public:
  Search(const RadarConfig& radar, std::vector<PoseMotion> poses) : radar_(radar), poses_(std::move(poses)) {
    for (const PoseMotion& p : poses_) views_.emplace_back(radar_, p);
    low_ = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
    high_ = -low_;
    std::set<std::string> locations;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      low_ = low_.cwiseMin(views_[i].position());
      high_ = high_.cwiseMax(views_[i].position());
      locations.insert(poses_[i].pose.location);
    }
    several_places_ = locations.size() > 1;
    const double reach_m = radar_.max_range_m();
    low_.array() -= reach_m;
    high_.array() += reach_m;
    // Poses far apart make a map of fewer, wider cells rather than an endless one.
    cell_m_ = std::max(kCell_m, (high_ - low_).maxCoeff() / 1000);
    columns_ = static_cast<int>((high_.x() - low_.x()) / cell_m_) + 1;
    rows_ = static_cast<int>((high_.y() - low_.y()) / cell_m_) + 1;
  }

  LocatedMotion run() {
    LocatedMotion motion;
    for (const PoseMotion& p : poses_) {
      for (const MovingEcho& e : p.echoes) {
        if (std::isfinite(e.radial_m_per_s)) return dopplerWalkers();
      }
    }
    for (std::size_t round = 0; round < 2 * kMostWalkers; ++round) {
      const Place place = strongestPlace();
      int bin = 0, beam = 0;
      const double fixed = several_places_ ? strongestCell(bin, beam) : 0;
      const auto carry = std::count_if(poses_.begin(), poses_.end(), [&](const PoseMotion& p) {
        return p.evidence.size() > 0 && p.evidence(bin, beam) > kPoseEvidence;
      });
      // Every cell of the map was a try, and every cell of the radar.
      const double tries = std::log(static_cast<double>(columns_) * rows_);
      if (carry > 2 && fixed >= place.evidence && tries + logChance(kTrust * fixed, poses_.size()) < kLogFalseAlarm) {
        motion.unexplained.push_back(bodyFixed(bin, beam, fixed));
        for (PoseMotion& p : poses_) clear(p, bin * radar_.range_bin_m(), 2.5 * radar_.range_bin_m());
        continue;
      }
      const double log_chance = tries + logChance(kTrust * place.evidence, poses_.size());
      if (log_chance >= kLogFalseAlarm || motion.walkers.size() == kMostWalkers) break;
      motion.walkers.push_back(walker(place, std::exp(log_chance)));
    }
    return motion;
  }

 private:
  Place strongestPlace() const {
    std::vector<float> sum(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0);
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      const Eigen::Vector2d at = views_[i].position();
      const double reach_m = radar_.max_range_m();
      const int c0 = std::max(0, column(at.x() - reach_m)), c1 = std::min(columns_ - 1, column(at.x() + reach_m));
      const int r0 = std::max(0, row(at.y() - reach_m)), r1 = std::min(rows_ - 1, row(at.y() + reach_m));
      if (!(poses_[i].evidence.size() > 0 && poses_[i].evidence.maxCoeff() > 0)) continue;
      for (int r = r0; r <= r1; ++r) {
        for (int c = c0; c <= c1; ++c) {
          int bin = 0, beam = 0;
          if (views_[i].cell(x(c), y(r), bin, beam)) {
            sum[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(c)] +=
                bounded(poses_[i].evidence(bin, beam));
          }
        }
      }
    }
    const auto best = std::max_element(sum.begin(), sum.end());
    const auto at = static_cast<int>(best - sum.begin());
    return {x(at % columns_), y(at / columns_), *best};
  }

  /// The cell that varies most over all poses but those of one location.
  double strongestCell(int& bin, int& beam, const std::string& without = "") const {
    Eigen::ArrayXXf sum;
    for (const PoseMotion& p : poses_) {
      if (!without.empty() && p.pose.location == without) continue;
      if (sum.size() == 0) sum = Eigen::ArrayXXf::Zero(p.evidence.rows(), p.evidence.cols());
      if (p.evidence.size() == sum.size()) sum += p.evidence.unaryExpr(&bounded);
    }
    return sum.size() > 0 ? sum.maxCoeff(&bin, &beam) : 0;
  }

  FrameFinding bodyFixed(int bin, int beam, double evidence) const {
    FrameFinding f;
    f.cause = "unknown";
    f.log_likelihood_gain = evidence;
    f.false_alarm_rate = std::min(
        1.0, std::exp(std::log(static_cast<double>(columns_) * rows_) + logChance(kTrust * evidence, poses_.size())));
    FindingPlace place;
    const double range_m = bin * radar_.range_bin_m();
    place.range_m = {range_m - radar_.range_bin_m(), range_m + radar_.range_bin_m()};
    for (const PoseMotion& p : poses_) {
      if (p.evidence.size() > 0 && p.evidence(bin, beam) > kPoseEvidence) f.poses.push_back(p.pose.name);
    }
    place.poses = f.poses;
    f.where = {place};
    std::ostringstream text;
    f.mechanism = toneIn(bin);
    for (const PoseMotion& p : poses_) {
      int at_bin = 0, at_beam = 0;
      const bool told = strongestCell(at_bin, at_beam, p.pose.location) > 0 && p.evidence.size() > 0;
      f.nats_by_pose[p.pose.name] = told ? p.evidence(at_bin, at_beam) : 0;
    }
    text << "frames disagree at one beat frequency (" << f.mechanism->values.number("beat_hz") / 1e6 << " MHz, range "
         << range_m << " m) at " << f.poses.size() << " of " << poses_.size()
         << " poses wherever the radar stands: it belongs to the radar, not to the room";
    f.description = text.str();
    return f;
  }

  /// The tone that is fixed to the radar, its level over one count, as the median of what frames show near its cell.
  NamedParameters toneIn(int bin) const {
    std::vector<double> range_m, sine, power;
    const std::vector<double> window = hannWindow(radar_.samples_per_chirp);
    double sum = 0, squares = 0;
    for (double w : window) sum += w, squares += w * w;
    for (const PoseMotion& p : poses_) {
      for (const MovingEcho& e : p.echoes) {
        if (std::abs(e.range_m - bin * radar_.range_bin_m()) > 1.5 * radar_.range_bin_m()) continue;
        range_m.push_back(e.range_m);
        sine.push_back(std::sin(e.azimuth_rad));
        // Of a tone of amplitude A: A^2 (sum w)^2 M / (variance sum w^2).
        power.push_back(e.snr * p.noise_variance * squares / (sum * sum * radar_.channels()));
      }
    }
    NamedParameters tone{"empirical_tone", {}};
    const double per_m = 2 * radar_.slope_hz_per_s / kSpeedOfLight_m_per_s;
    tone.values.set("beat_hz", per_m * (range_m.empty() ? bin * radar_.range_bin_m() : quantile(range_m, 0.5)));
    tone.values.set("level_db", power.empty() ? 0.0 : 10 * std::log10(quantile(power, 0.5)));
    tone.values.set("azimuth_deg", sine.empty() ? 0.0 : degrees(std::asin(quantile(sine, 0.5))));
    return tone;
  }

  /// Takes what lies in a span of ranges out of a pose.
  void clear(PoseMotion& p, double range_m, double half_m) const {
    const int low = std::max(0, static_cast<int>(std::floor((range_m - half_m) / radar_.range_bin_m())));
    const int high = std::min(static_cast<int>(p.evidence.rows()) - 1,
                              static_cast<int>(std::ceil((range_m + half_m) / radar_.range_bin_m())));
    if (high >= low) {
      const float peak = p.evidence.middleRows(low, high - low + 1).maxCoeff();
      p.evidence.middleRows(low, high - low + 1).setZero();
      p.evidence = (p.evidence < kBeside * peak).select(0.0f, p.evidence);
    }
    p.echoes.erase(std::remove_if(p.echoes.begin(), p.echoes.end(),
                                  [&](const MovingEcho& e) { return std::abs(e.range_m - range_m) <= half_m; }),
                   p.echoes.end());
  }

  /// Bodies whose speed the frames tell themselves: one walker per place, and per sense of motion at a pose.
  LocatedMotion dopplerWalkers() const {
    struct Sighting {
      std::size_t pose;
      MovingEcho echo;
      Eigen::Vector2d at;
    };
    std::vector<Sighting> sightings;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      for (const MovingEcho& e : poses_[i].echoes) sightings.push_back({i, e, views_[i].map(e.range_m, e.azimuth_rad)});
    }
    std::stable_sort(sightings.begin(), sightings.end(),
                     [](const auto& a, const auto& b) { return a.echo.snr > b.echo.snr; });
    std::vector<std::vector<Sighting>> walkers;
    for (const Sighting& s : sightings) {
      const auto known = std::find_if(walkers.begin(), walkers.end(), [&](const std::vector<Sighting>& w) {
        if ((w.front().at - s.at).norm() > kReach_m) return false;
        return std::none_of(w.begin(), w.end(), [&](const Sighting& o) {
          return o.pose == s.pose && o.echo.radial_m_per_s * s.echo.radial_m_per_s < 0;
        });
      });
      if (known != walkers.end()) {
        known->push_back(s);
      } else {
        walkers.push_back({s});
      }
    }
    LocatedMotion motion;
    for (const auto& walker : walkers) {
      FrameFinding f;
      f.cause = "moving_target";
      Eigen::Vector2d center = Eigen::Vector2d::Zero(), squares = center;
      double weights = 0, speed = 0, speed_squares = 0;
      FindingPlace place;
      place.range_m =
          place.azimuth_deg = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
      std::set<std::string> names;
      for (const Sighting& s : walker) {
        // Good to a range bin along the view and some 2 degrees, the array's errors, across it; a sum of equals.
        const double v = std::abs(s.echo.radial_m_per_s);
        center += s.at;
        squares += s.at.cwiseAbs2();
        speed += v;
        speed_squares += v * v;
        ++weights;
        f.log_likelihood_gain += s.echo.snr - 1 - std::log(s.echo.snr);
        const double azimuth_deg = degrees(s.echo.azimuth_rad);
        place.range_m = {std::min((*place.range_m)[0], s.echo.range_m - 0.5),
                         std::max((*place.range_m)[1], s.echo.range_m + 0.5)};
        place.azimuth_deg = {std::min((*place.azimuth_deg)[0], azimuth_deg - 10),
                             std::max((*place.azimuth_deg)[1], azimuth_deg + 10)};
        if (names.insert(poses_[s.pose].pose.name).second) f.poses.push_back(poses_[s.pose].pose.name);
      }
      // The threshold of a cell was 1e-9; a frame has some 1e4 of them.
      f.false_alarm_rate = 1e-5;
      center /= weights;
      speed /= weights;
      const double range_m = (center - views_[walker.front().pose].position()).norm();
      const double resolution_m_per_s = 0.1;  // of a walking body's parts
      const auto half = [&](double mean_square, double mean, double floor) {
        return 1.96 * std::hypot(std::sqrt(std::max(0.0, mean_square - mean * mean) / weights), floor);
      };
      const double half_x = half(squares.x() / weights, center.x(), std::hypot(0.1, 0.035 * range_m));
      const double half_y = half(squares.y() / weights, center.y(), std::hypot(0.1, 0.035 * range_m));
      const double half_v = half(speed_squares / weights, speed, resolution_m_per_s);
      f.parameters = {{"x_m", "m", center.x(), {{center.x() - half_x, center.x() + half_x}}},
                      {"y_m", "m", center.y(), {{center.y() - half_y, center.y() + half_y}}},
                      {"speed_m_per_s", "m/s", speed, {{std::max(0.0, speed - half_v), speed + half_v}}}};
      place.poses = f.poses;
      place.x_m = center.x();
      place.y_m = center.y();
      f.where = {place};
      std::ostringstream text;
      text << "something moves at (" << center.x() << ", " << center.y() << ") m in the map, at "
           << walker.front().echo.range_m << " m and " << degrees(walker.front().echo.azimuth_rad) << " deg of pose "
           << poses_[walker.front().pose].pose.name << ", "
           << (walker.front().echo.radial_m_per_s > 0 ? "away from" : "towards") << " the radar at " << speed << " m/s";
      f.description = text.str();
      motion.walkers.push_back(std::move(f));
    }
    return motion;
  }

  struct Track {
    std::size_t pose = 0;
    std::vector<int> frame;
    std::vector<Eigen::Vector2d> at;  ///< map
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  };

  /// The strongest echo of every frame near a place.
  Track track(std::size_t pose, const Eigen::Vector2d& place) const {
    Track t;
    t.pose = pose;
    double snr = 0;
    for (const MovingEcho& e : poses_[pose].echoes) {
      const Eigen::Vector2d at = views_[pose].map(e.range_m, e.azimuth_rad);
      if ((at - place).norm() > kReach_m) continue;
      if (!t.frame.empty() && t.frame.back() == e.frame) {
        if (e.snr <= snr) continue;
        t.at.back() = at;
      } else {
        t.frame.push_back(e.frame);
        t.at.push_back(at);
      }
      snr = e.snr;
    }
    for (const auto& at : t.at) t.mean += at / static_cast<double>(t.at.size());
    return t;
  }

  /// Where the walk has its middle: each pose's mean, weighed by how well a pose can know it.
  Eigen::Vector2d middle(std::vector<Track>& tracks, Eigen::Matrix2d& covariance) const {
    Eigen::Matrix2d total = Eigen::Matrix2d::Zero();
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (Track& t : tracks) {
      const Eigen::Vector2d ray = t.mean - views_[t.pose].position();
      const double r = std::max(ray.norm(), 0.1);
      const Eigen::Vector2d along = ray / r, across(-along.y(), along.x());
      // A few seconds see part of a walk of some decimetres; angles are good to some 2 degrees, the array's errors.
      const double part_m = 0.2 / std::sqrt(std::max(1.0, t.at.size() / 20.0));
      const double range_m = std::hypot(part_m, 0.05), cross_m = std::hypot(part_m, 0.035 * r);
      t.information =
          along * along.transpose() / (range_m * range_m) + across * across.transpose() / (cross_m * cross_m);
      total += t.information;
      sum += t.information * t.mean;
    }
    const Eigen::Matrix2d inverse = total.inverse();
    const Eigen::Vector2d center = inverse * sum;
    Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
    for (const Track& t : tracks) {
      const Eigen::Vector2d pull = t.information * (t.mean - center);
      scatter += pull * pull.transpose();
    }
    covariance = inverse;
    if (tracks.size() > 2) {
      const Eigen::Matrix2d sandwich = inverse * scatter * inverse * (tracks.size() / (tracks.size() - 1.0));
      if (sandwich.trace() > covariance.trace()) covariance = sandwich;
    }
    return center;
  }

  struct Speed {
    double value = 0, low = 0, high = 0;
  };

  /// Speed^2 of bodies that turn back every straight_s: the mean square of the way between two frames is
  /// v^2 t^2 (1 - 2/3 t / straight_s) for a time t between them, for the share t / straight_s of ways has a turn in it
  /// and is a third of v^2 t^2 in the mean; the errors of single places add a constant to each track's.
  /// misfit: of the mean over tracks, by which one straight_s is better than another.
  double speed2(const std::vector<const Track*>& tracks, double straight_s, double& misfit) const {
    constexpr int kLags = 8;
    double counts[kLags] = {}, means[kLags] = {}, grows[kLags];
    for (int lag = 0; lag < kLags; ++lag) {
      const double time_s = (lag + 1) * radar_.frame_period_s;
      grows[lag] = time_s * time_s * (1 - 2.0 / 3 * std::min(time_s, straight_s) / straight_s);
    }
    double all_weight = 0, all_slope = 0;
    for (const Track* t : tracks) {
      double count[kLags] = {}, square[kLags] = {};
      for (std::size_t i = 0; i < t->frame.size(); ++i) {
        for (std::size_t j = i + 1; j < t->frame.size() && t->frame[j] - t->frame[i] <= kLags; ++j) {
          const int lag = t->frame[j] - t->frame[i] - 1;
          ++count[lag];
          square[lag] += (t->at[j] - t->at[i]).squaredNorm();
        }
      }
      double w = 0, mx = 0, my = 0, xx = 0, xy = 0;
      for (int lag = 0; lag < kLags; ++lag) {
        const double x = grows[lag];
        counts[lag] += count[lag];
        means[lag] += square[lag];
        w += count[lag];
        mx += count[lag] * x;
        my += square[lag];
        xx += count[lag] * x * x;
        xy += x * square[lag];
      }
      const double spread = w > 0 ? xx - mx * mx / w : 0;
      if (!(spread > 0) || w < 8) continue;
      all_weight += w;
      all_slope += w * (xy - mx * my / w) / spread;
    }
    misfit = 0;
    if (!(all_weight > 0)) return 0;
    Eigen::Matrix<double, kLags, 2> basis;
    Eigen::Matrix<double, kLags, 1> weight, mean;
    for (int lag = 0; lag < kLags; ++lag) {
      weight[lag] = std::sqrt(counts[lag]);
      mean[lag] = counts[lag] > 0 ? weight[lag] * means[lag] / counts[lag] : 0;
      basis.row(lag) = weight[lag] * Eigen::RowVector2d(1, grows[lag]);
    }
    const Eigen::Vector2d line = basis.colPivHouseholderQr().solve(mean);
    misfit = (mean - basis * line).squaredNorm();
    return std::max(0.0, all_slope / all_weight);
  }

  /// With the way between two turns that leaves the least misfit.
  double speedOf(const std::vector<const Track*>& tracks) const {
    double least = std::numeric_limits<double>::infinity(), best = 0;
    for (double straight_s : {100.0, 2.0, 1.4, 1.0, 0.8, 0.7, 0.65, 0.6, 0.55, 0.5, 0.45}) {
      double misfit = 0;
      const double v2 = speed2(tracks, straight_s, misfit);
      if (misfit < least) best = std::sqrt(v2);
      least = std::min(least, misfit);
    }
    return best;
  }

  Speed speed(const std::vector<Track>& tracks) const {
    std::vector<const Track*> all;
    for (const Track& t : tracks) all.push_back(&t);
    Speed s;
    s.value = speedOf(all);
    // Jackknife over poses; a lone one is known to a factor of two.
    double variance = 0;
    for (std::size_t i = 0; all.size() > 2 && i < all.size(); ++i) {
      std::vector<const Track*> rest = all;
      rest.erase(rest.begin() + static_cast<long>(i));
      variance += std::pow(speedOf(rest) - s.value, 2);
    }
    const double half =
        all.size() > 2 ? 1.96 * std::hypot(std::sqrt(variance * (all.size() - 1.0) / all.size()), kWalkError * s.value)
                       : s.value;
    s.low = std::max(0.0, s.value - half);
    s.high = s.value + half;
    return s;
  }

  FrameFinding walker(const Place& found, double false_alarm_rate) {
    FrameFinding f;
    f.cause = "moving_target";
    f.false_alarm_rate = std::min(1.0, false_alarm_rate);
    Eigen::Vector2d center(found.x_m, found.y_m);
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity() * 0.3 * 0.3;
    std::vector<Track> tracks;
    for (int pass = 0; pass < 3; ++pass) {
      tracks.clear();
      for (std::size_t i = 0; i < poses_.size(); ++i) {
        int bin = 0, beam = 0;
        if (!views_[i].cell(center.x(), center.y(), bin, beam)) continue;
        Track t = track(i, center);
        if (t.at.size() >= 5 || (poses_.size() == 1 && !t.at.empty())) tracks.push_back(std::move(t));
      }
      if (tracks.empty()) break;
      center = middle(tracks, covariance);
    }
    const Speed v = speed(tracks);
    const auto interval = [](double value, double variance) {
      const double half = 1.96 * std::sqrt(variance);
      return std::vector<std::array<double, 2>>{{value - half, value + half}};
    };
    f.parameters = {{"x_m", "m", center.x(), interval(center.x(), covariance(0, 0))},
                    {"y_m", "m", center.y(), interval(center.y(), covariance(1, 1))},
                    {"speed_m_per_s", "m/s", v.value, {{v.low, v.high}}}};
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      PoseMotion& p = poses_[i];
      const Eigen::Vector3d d =
          p.pose.T_map_radar.linear().transpose() *
          Eigen::Vector3d(center.x() - views_[i].position().x(), center.y() - views_[i].position().y(), 0);
      // The walk's middle may be behind the radar and one of its ends before it.
      if (p.evidence.size() == 0 || d.x() < -kReach_m || d.norm() > radar_.max_range_m()) continue;
      const int bin = static_cast<int>(std::lround(d.norm() / radar_.range_bin_m()));
      const int around = static_cast<int>(std::ceil(kReach_m / radar_.range_bin_m()));
      const int high = std::min(static_cast<int>(p.evidence.rows()) - 1, bin + around);
      const int low = std::clamp(bin - around, 0, high);
      Eigen::Index peak_bin = 0, peak_beam = 0;
      const float peak = p.evidence.middleRows(low, high - low + 1).maxCoeff(&peak_bin, &peak_beam);
      const double range_m = (views_[i].position() - center).norm();
      if (peak > kPoseEvidence) {
        f.log_likelihood_gain += peak;
        f.poses.push_back(p.pose.name);
        const double azimuth_deg = degrees(std::atan2(d.y(), d.x()));
        FindingPlace place;
        place.range_m = {range_m - 0.5, range_m + 0.5};
        place.azimuth_deg = {azimuth_deg - degrees(0.5 / std::max(range_m, 0.5)),
                             azimuth_deg + degrees(0.5 / std::max(range_m, 0.5))};
        place.poses = {p.pose.name};
        place.x_m = center.x();
        place.y_m = center.y();
        f.where.push_back(place);
      }
      clear(p, range_m, kReach_m);
    }
    f.log_likelihood_gain = std::max(f.log_likelihood_gain, found.evidence);
    std::ostringstream text;
    text << "something moves about (" << center.x() << ", " << center.y() << ") m in the map at " << v.value
         << " m/s; seen at " << f.poses.size() << " of " << poses_.size() << " poses";
    f.description = text.str();
    return f;
  }

  double x(int column) const { return low_.x() + (column + 0.5) * cell_m_; }
  double y(int row) const { return low_.y() + (row + 0.5) * cell_m_; }
  int column(double x_m) const { return static_cast<int>(std::floor((x_m - low_.x()) / cell_m_)); }
  int row(double y_m) const { return static_cast<int>(std::floor((y_m - low_.y()) / cell_m_)); }

  const RadarConfig& radar_;
  std::vector<PoseMotion> poses_;
  std::vector<View> views_;
  Eigen::Vector2d low_, high_;
  double cell_m_ = kCell_m;
  int columns_ = 0, rows_ = 0;
  bool several_places_ = false;
};

}  // namespace

LocatedMotion locateMotion(const RadarConfig& radar, std::vector<PoseMotion> poses) {
  if (poses.empty()) return {};
  return Search(radar, std::move(poses)).run();
}

}  // namespace mmradartwin::diagnosis::frames
