#include "diagnosis/frames/motion_locator.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <sstream>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/frames/walker_findings.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin::diagnosis::frames {
namespace {

constexpr double kCell_m = 0.15;             ///< of the map: about a range bin of the paper's radar
constexpr int kMostCells = 1000;             ///< of the map, along either axis
constexpr double kReach_m = 1.0;             ///< radius of a walker's motion, and the width of a beam at some metres
constexpr double kAround_m = 0.5;            ///< half the size of a finding's place
constexpr double kAround_deg = 10;           ///< half the width of a finding's place by Doppler
constexpr std::size_t kMostWalkers = 4;      ///< walkers that are stated
constexpr std::size_t kFewestPlaces = 5;     ///< positions of a track that counts
constexpr int kPasses = 3;                   ///< iterations of tracks about a moving centre
constexpr float kBesideShare = 0.01f;        ///< share of a peak down to which sidelobes of window and array reach
constexpr double kPlaceError_m = 0.3;        ///< standard error of a walk's place without tracks
constexpr double kRangeError_m = 0.1;        ///< standard error along the view, about a range bin
constexpr double kAngleError_rad = 0.035;    ///< standard error across the view: 2 degrees, the array's errors
constexpr double kLimbSpeeds_m_per_s = 0.1;  ///< between parts of a walking body

const double kLogFalseAlarm = std::log(bounds::kFramesFalseAlarmRate);

/// Place in the map with its evidence in nats.
struct Place {
  double x_m = 0, y_m = 0, evidence = 0;
};

/// Evidence of one pose, limited for the sum over poses.
float bounded(float evidence) { return evidence / (1 + evidence / bounds::kConvincingNatsAtPose); }

double degrees(double rad) { return rad * 180 / M_PI; }

/// Logarithm of the probability that `poses` cells of noise sum to `evidence`, by Chernoff's bound over t. A cell holds
/// half the square of the positive part of a normal number, for which E exp(t e) = 1/2 + 1/2 (1 - t)^(-1/2).
double logChance(double evidence, std::size_t poses) {
  double best = 0;
  for (double t = 0.02; t < 1; t += 0.02) {
    best = std::min(best, -t * evidence + static_cast<double>(poses) * std::log(0.5 + 0.5 / std::sqrt(1 - t)));
  }
  return best;
}

/// View from a pose: cells of places in the map, and places of ranges and azimuths.
class View {
 public:
  View(const RadarConfig& radar, const PoseMotion& pose)
      : R_(pose.pose.T_map_radar.linear().transpose()),
        p_(pose.pose.T_map_radar.translation()),
        per_bin_(1 / radar.range_bin_m()),
        per_sine_(2 * radar.virtual_pitch_m() / radar.wavelength_m() * (kAngleBins / 2)),
        bins_(static_cast<int>(pose.evidence.rows())) {}
  /// Cell of a place; false where the place is behind the radar or beyond its range.
  bool cell(double x_m, double y_m, int& bin, int& beam) const {
    // An array along y does not measure elevation: the place is taken at the radar's height.
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

/// Search for walkers and for tones of the radar in the evidence of all poses.
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
    // Poses far apart make cells larger, not more numerous.
    cell_m_ = std::max(kCell_m, (high_ - low_).maxCoeff() / kMostCells);
    columns_ = static_cast<int>((high_.x() - low_.x()) / cell_m_) + 1;
    rows_ = static_cast<int>((high_.y() - low_.y()) / cell_m_) + 1;
  }

  LocatedMotion run() {
    LocatedMotion motion;
    const bool tracked = std::any_of(poses_.begin(), poses_.end(),
                                     [&](const PoseMotion& p) { return canTrackWalkers(radar_, p.frames); });
    motion.walkers = trackedWalkers();
    for (PoseMotion& p : poses_) clearTracks(p);
    for (const PoseMotion& p : poses_) {
      if (tracked) break;
      for (const MovingEcho& e : p.echoes) {
        if (std::isfinite(e.radial_m_per_s)) return dopplerWalkers();
      }
    }
    for (std::size_t round = 0; round < 2 * kMostWalkers; ++round) {
      const Place place = strongestPlace();
      int bin = 0, beam = 0;
      const double fixed = several_places_ ? strongestCell(bin, beam) : 0;
      const auto carry = std::count_if(poses_.begin(), poses_.end(), [&](const PoseMotion& p) {
        return p.evidence.size() > 0 && p.evidence(bin, beam) > bounds::kLeastNatsAtPose;
      });
      // Every cell of the map was tried; the radar has fewer cells.
      const double tries = std::log(static_cast<double>(columns_) * rows_);
      if (carry > 2 && fixed >= place.evidence &&
          tries + logChance(bounds::kTrustInMotion * fixed, poses_.size()) < kLogFalseAlarm) {
        motion.unexplained.push_back(bodyFixed(bin, beam, fixed));
        for (PoseMotion& p : poses_) clear(p, bin * radar_.range_bin_m(), 2.5 * radar_.range_bin_m());
        continue;
      }
      if (tracked) break;
      const double log_chance = tries + logChance(bounds::kTrustInMotion * place.evidence, poses_.size());
      if (log_chance >= kLogFalseAlarm || motion.walkers.size() == kMostWalkers) break;
      motion.walkers.push_back(walker(place, std::exp(log_chance)));
    }
    return motion;
  }

 private:
  std::vector<FrameFinding> trackedWalkers() const {
    std::vector<PoseTracks> tracks;
    for (const PoseMotion& p : poses_) tracks.push_back({&p.pose, &p.tracks});
    return walkerFindings(radar_, tracks);
  }

  /// Place in the map of highest evidence over all poses.
  Place strongestPlace() const {
    std::vector<float> sum(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0);
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      const Eigen::Vector2d radar = views_[i].position();
      const double reach_m = radar_.max_range_m();
      const int c0 = std::max(0, column(radar.x() - reach_m)), c1 = std::min(columns_ - 1, column(radar.x() + reach_m));
      const int r0 = std::max(0, row(radar.y() - reach_m)), r1 = std::min(rows_ - 1, row(radar.y() + reach_m));
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
    const auto cell = static_cast<int>(best - sum.begin());
    return {x(cell % columns_), y(cell / columns_), *best};
  }

  /// Cell of range and angle of highest evidence, over all poses except those of one location, and this evidence.
  double strongestCell(int& bin, int& beam, const std::string& without = "") const {
    Eigen::ArrayXXf sum;
    for (const PoseMotion& p : poses_) {
      if (!without.empty() && p.pose.location == without) continue;
      if (sum.size() == 0) sum = Eigen::ArrayXXf::Zero(p.evidence.rows(), p.evidence.cols());
      if (p.evidence.size() == sum.size()) sum += p.evidence.unaryExpr(&bounded);
    }
    return sum.size() > 0 ? sum.maxCoeff(&bin, &beam) : 0;
  }

  /// Finding of a tone of the radar in a cell.
  FrameFinding bodyFixed(int bin, int beam, double evidence) const {
    FrameFinding finding;
    finding.cause = "unknown";
    finding.log_likelihood_gain = evidence;
    finding.false_alarm_rate = std::min(1.0, std::exp(std::log(static_cast<double>(columns_) * rows_) +
                                                      logChance(bounds::kTrustInMotion * evidence, poses_.size())));
    FindingPlace place;
    const double range_m = bin * radar_.range_bin_m();
    place.range_m = {range_m - radar_.range_bin_m(), range_m + radar_.range_bin_m()};
    for (const PoseMotion& p : poses_) {
      if (p.evidence.size() > 0 && p.evidence(bin, beam) > bounds::kLeastNatsAtPose)
        finding.poses.push_back(p.pose.name);
    }
    place.poses = finding.poses;
    finding.where = {place};
    std::ostringstream text;
    finding.mechanism = toneIn(bin);
    for (const PoseMotion& p : poses_) {
      int at_bin = 0, at_beam = 0;
      const bool told = strongestCell(at_bin, at_beam, p.pose.location) > 0 && p.evidence.size() > 0;
      finding.nats_by_pose[p.pose.name] = told ? p.evidence(at_bin, at_beam) : 0;
    }
    text << "frames disagree at one beat frequency (" << finding.mechanism->values.number("beat_hz") / 1e6
         << " MHz, range " << range_m << " m) at " << finding.poses.size() << " of " << poses_.size()
         << " poses wherever the radar stands: it belongs to the radar, not to the room";
    finding.description = text.str();
    return finding;
  }

  /// Tone of the radar about a range bin, from medians of the echoes there. Its level is relative to one ADC count.
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
        // A tone of amplitude A has snr = A^2 (sum w)^2 M / (variance sum w^2).
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

  /// Removes the evidence and echoes of walkers with tracks.
  void clearTracks(PoseMotion& pose) const {
    for (const WalkTrack& t : pose.tracks) {
      const double begin_m = t.at(t.first_frame * radar_.frame_period_s)[0],
                   end_m = t.at(t.last_frame * radar_.frame_period_s)[0];
      clear(pose, 0.5 * (begin_m + end_m), 0.5 * std::abs(end_m - begin_m) + kReach_m);
    }
  }

  /// Removes the evidence and echoes of an interval of ranges from a pose.
  void clear(PoseMotion& pose, double range_m, double half_m) const {
    const int low = std::max(0, static_cast<int>(std::floor((range_m - half_m) / radar_.range_bin_m())));
    const int high = std::min(static_cast<int>(pose.evidence.rows()) - 1,
                              static_cast<int>(std::ceil((range_m + half_m) / radar_.range_bin_m())));
    if (high >= low) {
      const float peak = pose.evidence.middleRows(low, high - low + 1).maxCoeff();
      pose.evidence.middleRows(low, high - low + 1).setZero();
      pose.evidence = (pose.evidence < kBesideShare * peak).select(0.0f, pose.evidence);
    }
    pose.echoes.erase(std::remove_if(pose.echoes.begin(), pose.echoes.end(),
                                     [&](const MovingEcho& e) { return std::abs(e.range_m - range_m) <= half_m; }),
                      pose.echoes.end());
  }

  struct Sighting {
    std::size_t pose;
    MovingEcho echo;
    Eigen::Vector2d place;  ///< in the map
  };

  /// Sightings by walker: near its strongest sighting, and with one sense of motion at a pose. Strongest first.
  std::vector<std::vector<Sighting>> sightingsOfWalkers() const {
    std::vector<Sighting> sightings;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      for (const MovingEcho& e : poses_[i].echoes) sightings.push_back({i, e, views_[i].map(e.range_m, e.azimuth_rad)});
    }
    std::stable_sort(sightings.begin(), sightings.end(),
                     [](const auto& a, const auto& b) { return a.echo.snr > b.echo.snr; });
    std::vector<std::vector<Sighting>> walkers;
    for (const Sighting& sighting : sightings) {
      const auto known = std::find_if(walkers.begin(), walkers.end(), [&](const std::vector<Sighting>& w) {
        if ((w.front().place - sighting.place).norm() > kReach_m) return false;
        return std::none_of(w.begin(), w.end(), [&](const Sighting& other) {
          return other.pose == sighting.pose && other.echo.radial_m_per_s * sighting.echo.radial_m_per_s < 0;
        });
      });
      if (known != walkers.end()) {
        known->push_back(sighting);
      } else {
        walkers.push_back({sighting});
      }
    }
    return walkers;
  }

  /// Walkers whose speed the frames show by Doppler: one per place and, at one pose, per sense of motion.
  LocatedMotion dopplerWalkers() const {
    LocatedMotion motion;
    for (const auto& walker : sightingsOfWalkers()) motion.walkers.push_back(dopplerWalker(walker));
    return motion;
  }

  FrameFinding dopplerWalker(const std::vector<Sighting>& walker) const {
    FrameFinding finding;
    finding.cause = "moving_target";
    finding.false_alarm_rate = bounds::kDopplerFalseAlarmRate;
    Eigen::Vector2d center = Eigen::Vector2d::Zero(), squares = center;
    double count = 0, speed = 0, speed_squares = 0;
    FindingPlace place;
    place.range_m =
        place.azimuth_deg = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    std::set<std::string> names;
    for (const Sighting& sighting : walker) {
      const double v = std::abs(sighting.echo.radial_m_per_s);
      center += sighting.place;
      squares += sighting.place.cwiseAbs2();
      speed += v;
      speed_squares += v * v;
      ++count;
      finding.log_likelihood_gain += sighting.echo.snr - 1 - std::log(sighting.echo.snr);
      const double azimuth_deg = degrees(sighting.echo.azimuth_rad);
      place.range_m = {std::min((*place.range_m)[0], sighting.echo.range_m - kAround_m),
                       std::max((*place.range_m)[1], sighting.echo.range_m + kAround_m)};
      place.azimuth_deg = {std::min((*place.azimuth_deg)[0], azimuth_deg - kAround_deg),
                           std::max((*place.azimuth_deg)[1], azimuth_deg + kAround_deg)};
      if (names.insert(poses_[sighting.pose].pose.name).second)
        finding.poses.push_back(poses_[sighting.pose].pose.name);
    }
    center /= count;
    speed /= count;
    const double range_m = (center - views_[walker.front().pose].position()).norm();
    const auto half = [&](double mean_square, double mean, double floor) {
      return 1.96 * std::hypot(std::sqrt(std::max(0.0, mean_square - mean * mean) / count), floor);
    };
    const double floor_m = std::hypot(kRangeError_m, kAngleError_rad * range_m);
    const double half_x = half(squares.x() / count, center.x(), floor_m);
    const double half_y = half(squares.y() / count, center.y(), floor_m);
    const double half_v = half(speed_squares / count, speed, kLimbSpeeds_m_per_s);
    finding.parameters = {{"x_m", "m", center.x(), {{center.x() - half_x, center.x() + half_x}}},
                          {"y_m", "m", center.y(), {{center.y() - half_y, center.y() + half_y}}},
                          {"speed_m_per_s", "m/s", speed, {{std::max(0.0, speed - half_v), speed + half_v}}}};
    place.poses = finding.poses;
    place.x_m = center.x();
    place.y_m = center.y();
    finding.where = {place};
    const Sighting& strongest = walker.front();
    std::ostringstream text;
    text << "something moves at (" << center.x() << ", " << center.y() << ") m in the map, at "
         << strongest.echo.range_m << " m and " << degrees(strongest.echo.azimuth_rad) << " deg of pose "
         << poses_[strongest.pose].pose.name << ", " << (strongest.echo.radial_m_per_s > 0 ? "away from" : "towards")
         << " the radar at " << speed << " m/s";
    finding.description = text.str();
    return finding;
  }

  /// Positions of a walker, frame by frame, seen from one pose.
  struct Track {
    std::size_t pose = 0;
    std::vector<int> frame;
    std::vector<Eigen::Vector2d> places;  ///< [frames seen] in the map
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  };

  /// Track of the strongest echo of every frame near a place.
  Track track(std::size_t pose, const Eigen::Vector2d& place) const {
    Track track;
    track.pose = pose;
    double snr = 0;
    for (const MovingEcho& echo : poses_[pose].echoes) {
      const Eigen::Vector2d seen = views_[pose].map(echo.range_m, echo.azimuth_rad);
      if ((seen - place).norm() > kReach_m) continue;
      if (!track.frame.empty() && track.frame.back() == echo.frame) {
        if (echo.snr <= snr) continue;
        track.places.back() = seen;
      } else {
        track.frame.push_back(echo.frame);
        track.places.push_back(seen);
      }
      snr = echo.snr;
    }
    for (const auto& seen : track.places) track.mean += seen / static_cast<double>(track.places.size());
    return track;
  }

  /// Centre of a walk: the mean of each pose's track, weighted by the accuracy of the pose's view.
  Eigen::Vector2d middle(std::vector<Track>& tracks, Eigen::Matrix2d& covariance) const {
    Eigen::Matrix2d total = Eigen::Matrix2d::Zero();
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (Track& track : tracks) {
      const Eigen::Vector2d ray = track.mean - views_[track.pose].position();
      const double r = std::max(ray.norm(), 0.1);
      const Eigen::Vector2d along = ray / r, across(-along.y(), along.x());
      // A few seconds show only a part of a walk, of some decimetres.
      const double part_m = 0.2 / std::sqrt(std::max(1.0, track.places.size() / 20.0));
      const double range_m = std::hypot(part_m, 0.05), cross_m = std::hypot(part_m, kAngleError_rad * r);
      track.information =
          along * along.transpose() / (range_m * range_m) + across * across.transpose() / (cross_m * cross_m);
      total += track.information;
      sum += track.information * track.mean;
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

  /// Speed with its 95 % interval, m/s.
  struct Speed {
    double value = 0, low = 0, high = 0;
  };

  /// Squared speed of bodies that turn back every straight_s. The mean square displacement between two frames, a time t
  /// apart, is v^2 t^2 (1 - 2/3 t / straight_s): a share t / straight_s of the displacements contains a turn, and their
  /// mean square is a third of v^2 t^2. Errors of single positions add a constant to each track. misfit: that of the
  /// mean over tracks, by which values of straight_s are compared.
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
          square[lag] += (t->places[j] - t->places[i]).squaredNorm();
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

  /// Speed for the time between two turns of least misfit.
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

  /// Speed with its interval by a jackknife over poses, and by what errors of range hide over the longest track.
  /// Nothing where no track tells a speed.
  std::optional<Speed> speed(const std::vector<Track>& tracks) const {
    std::vector<const Track*> all;
    double longest_s = 0;
    for (const Track& t : tracks) {
      all.push_back(&t);
      if (t.frame.size() > 1)
        longest_s = std::max(longest_s, (t.frame.back() - t.frame.front()) * radar_.frame_period_s);
    }
    if (!(longest_s > 0)) return std::nullopt;
    Speed speed;
    speed.value = speedOf(all);
    // One or two poses determine a speed to a factor of two.
    double variance = 0;
    for (std::size_t i = 0; all.size() > 2 && i < all.size(); ++i) {
      std::vector<const Track*> rest = all;
      rest.erase(rest.begin() + static_cast<long>(i));
      variance += std::pow(speedOf(rest) - speed.value, 2);
    }
    const double spread = all.size() > 2 ? 1.96 * std::hypot(std::sqrt(variance * (all.size() - 1.0) / all.size()),
                                                             bounds::kWalkSpeedError * speed.value)
                                         : speed.value;
    const double half = std::hypot(spread, 1.96 * kRangeError_m / longest_s);
    speed.low = std::max(0.0, speed.value - half);
    speed.high = speed.value + half;
    return speed;
  }

  /// Centre of a walk that begins about a place, with its covariance, and the tracks that determine it.
  struct Walk {
    Eigen::Vector2d center;
    Eigen::Matrix2d covariance;
    std::vector<Track> tracks;
  };

  Walk walkAbout(const Place& found) const {
    Walk walk{{found.x_m, found.y_m}, Eigen::Matrix2d::Identity() * kPlaceError_m * kPlaceError_m, {}};
    for (int pass = 0; pass < kPasses; ++pass) {
      walk.tracks.clear();
      for (std::size_t i = 0; i < poses_.size(); ++i) {
        int bin = 0, beam = 0;
        if (!views_[i].cell(walk.center.x(), walk.center.y(), bin, beam)) continue;
        Track t = track(i, walk.center);
        if (t.places.size() >= kFewestPlaces || (poses_.size() == 1 && !t.places.empty())) {
          walk.tracks.push_back(std::move(t));
        }
      }
      if (walk.tracks.empty()) break;
      walk.center = middle(walk.tracks, walk.covariance);
    }
    return walk;
  }

  /// Finding of a walker at a place, whose evidence is removed from all poses.
  FrameFinding walker(const Place& found, double false_alarm_rate) {
    FrameFinding finding;
    finding.cause = "moving_target";
    finding.false_alarm_rate = std::min(1.0, false_alarm_rate);
    const Walk walk = walkAbout(found);
    const Eigen::Vector2d& center = walk.center;
    const std::optional<Speed> walking_speed = speed(walk.tracks);
    const auto interval = [](double value, double variance) {
      const double half = 1.96 * std::sqrt(variance);
      return std::vector<std::array<double, 2>>{{value - half, value + half}};
    };
    finding.parameters = {{"x_m", "m", center.x(), interval(center.x(), walk.covariance(0, 0))},
                          {"y_m", "m", center.y(), interval(center.y(), walk.covariance(1, 1))},
                          {"speed_m_per_s", "m/s", std::numeric_limits<double>::quiet_NaN(), {}}};
    if (walking_speed) {
      finding.parameters.back().value = walking_speed->value;
      finding.parameters.back().ci95 = {{walking_speed->low, walking_speed->high}};
    }
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      PoseMotion& pose = poses_[i];
      const Eigen::Vector3d d =
          pose.pose.T_map_radar.linear().transpose() *
          Eigen::Vector3d(center.x() - views_[i].position().x(), center.y() - views_[i].position().y(), 0);
      // The walk's centre may be behind the radar and one of its ends before it.
      if (pose.evidence.size() == 0 || d.x() < -kReach_m || d.norm() > radar_.max_range_m()) continue;
      const double range_m = (views_[i].position() - center).norm();
      const float peak = peakAbout(pose, d.norm());
      if (peak > bounds::kLeastNatsAtPose) {
        finding.log_likelihood_gain += peak;
        finding.poses.push_back(pose.pose.name);
        const double azimuth_deg = degrees(std::atan2(d.y(), d.x()));
        const double around_deg = degrees(kAround_m / std::max(range_m, kAround_m));
        FindingPlace place;
        place.range_m = {range_m - kAround_m, range_m + kAround_m};
        place.azimuth_deg = {azimuth_deg - around_deg, azimuth_deg + around_deg};
        place.poses = {pose.pose.name};
        place.x_m = center.x();
        place.y_m = center.y();
        finding.where.push_back(place);
      }
      clear(pose, range_m, kReach_m);
    }
    finding.log_likelihood_gain = std::max(finding.log_likelihood_gain, found.evidence);
    std::ostringstream text;
    text << "something moves about (" << center.x() << ", " << center.y() << ") m in the map";
    if (walking_speed) {
      text << " at " << walking_speed->value << " m/s";
    } else {
      text << "; its speed is not told";
    }
    text << "; seen at " << finding.poses.size() << " of " << poses_.size() << " poses";
    finding.description = text.str();
    return finding;
  }

  /// Highest evidence of a pose near a range, over all angles.
  float peakAbout(const PoseMotion& p, double range_m) const {
    const int bin = static_cast<int>(std::lround(range_m / radar_.range_bin_m()));
    const int around = static_cast<int>(std::ceil(kReach_m / radar_.range_bin_m()));
    const int high = std::min(static_cast<int>(p.evidence.rows()) - 1, bin + around);
    const int low = std::clamp(bin - around, 0, high);
    return p.evidence.middleRows(low, high - low + 1).maxCoeff();
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
