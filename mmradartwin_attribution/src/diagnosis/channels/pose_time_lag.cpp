#include "diagnosis/channels/pose_time_lag.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <functional>
#include <iomanip>
#include <limits>
#include <sstream>
#include <utility>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin::diagnosis::channels {
namespace {

const std::string kName = "pose_time_lag";
constexpr double kLongest_s = 1;         ///< longest delay that is tried
constexpr double kStep_s = 0.005;        ///< between delays that are tried
constexpr double kAround_s = 1.2;        ///< time about a motion's ends within which frames are read
constexpr double kSpeed_m_per_s = 0.05;  ///< speed above which a radar moves; tf of visual odometry trembles by less
constexpr double kSmooth_s = 0.1;        ///< half the time over which speeds are averaged
constexpr double kRest_s = 0.5;          ///< a shorter stop is a part of the motion
constexpr double kFarthest_s = 0.3;      ///< longest time between successive frames
constexpr double kSlow_m_per_s[] = {0.01, 0.02, 0.05};  ///< slowest speeds that frames may show
constexpr double kAtRest = 0.1;                         ///< upper limit of Way::moves() for a standing radar
constexpr double kMoved = 0.05;        ///< share of the change during motion that a radar at rest does not exceed
constexpr double kMovedOverStill = 4;  ///< multiple of the change at rest that a radar at rest does not exceed
constexpr double kNear_m = 0.3;        ///< range up to which there is leakage, which moves with the radar

double secondsSince(std::int64_t zero_ns, std::int64_t stamp_ns) {
  return 1e-9 * static_cast<double>(stamp_ns - zero_ns);
}

/// Reported path of the radar: linear between frames. The radar stands before the first and after the last frame.
class Way {
 public:
  Way(const std::vector<StampedTransform>& track, std::int64_t zero_ns) {
    for (const StampedTransform& t : track) {
      at_s_.push_back(secondsSince(zero_ns, t.stamp_ns));
      place_.push_back(t.T_map_radar.translation());
    }
  }
  double speed_m_per_s(double t_s) const {
    return (at(t_s + kSmooth_s) - at(t_s - kSmooth_s)).norm() / (2 * kSmooth_s);
  }
  /// 0 where the radar stands, 1 where it moves much faster than a slow speed.
  double moves(double t_s, double slow_m_per_s) const {
    const double v = speed_m_per_s(t_s) / slow_m_per_s;
    return 1 - std::exp(-v * v);
  }
  Eigen::Vector3d at(double t_s) const {
    const auto next = std::upper_bound(at_s_.begin(), at_s_.end(), t_s);
    if (next == at_s_.begin()) return place_.front();
    if (next == at_s_.end()) return place_.back();
    const std::size_t i = static_cast<std::size_t>(next - at_s_.begin());
    const double share = (t_s - at_s_[i - 1]) / (at_s_[i] - at_s_[i - 1]);
    return (1 - share) * place_[i - 1] + share * place_[i];
  }

 private:
  std::vector<double> at_s_;
  std::vector<Eigen::Vector3d> place_;
};

/// Time from a frame's stamp to its middle. Where radar.yaml does not state the chirps' duration, that of their samples
/// is used.
double halfFrame_s(const RadarConfig& radar) {
  const double sampled_s = radar.adc_start_s + radar.samples_per_chirp / radar.sample_rate_hz;
  const double said_s = radar.idle_s + radar.ramp_end_s;
  return 0.5 * radar.chirps_per_frame() * (std::isnan(said_s) ? sampled_s : said_s);
}

/// Changes between successive frames, from one time to another.
std::vector<FrameChange> changesBetween(const Recording& recording, std::int64_t zero_ns, double from_s, double to_s) {
  const SignalChain chain(recording.radar);
  const RangeAngleAxes& axes = chain.axes();
  const Eigen::Index first = std::upper_bound(axes.range_m.begin(), axes.range_m.end(), kNear_m) - axes.range_m.begin();
  std::vector<FrameChange> changes;
  ComplexGrid before;
  double before_s = 0;
  const auto stamp_ns = [&](double t_s) { return zero_ns + std::llround(1e9 * t_s); };
  recording.forEachFrameBetween(stamp_ns(from_s), stamp_ns(to_s), [&](const AdcCube& cube) {
    const ComplexGrid spectra = frameSpectra(chain, cube);
    if (spectra.size() == 0) return;
    ComplexGrid now = spectra.rightCols(spectra.cols() - first);
    const double now_s = secondsSince(zero_ns, cube.stamp_ns);
    if (before.size() > 0 && now_s > before_s && now_s - before_s < kFarthest_s) {
      changes.push_back({0.5 * (now_s + before_s) + halfFrame_s(recording.radar), changeBetween(now, before)});
    }
    before = std::move(now);
    before_s = now_s;
  });
  return changes;
}

/// Names of the first pose after each motion.
std::vector<std::string> posesAfter(const Recording& recording, std::int64_t zero_ns,
                                    const std::vector<MovingStretch>& motions) {
  std::vector<std::string> poses;
  for (const MovingStretch& m : motions) {
    for (const Pose& p : recording.poses) {
      const double t_s = secondsSince(zero_ns, p.stamp_ns);
      if (t_s > m.from_s && t_s < m.to_s + kAround_s) {
        poses.push_back(p.name);
        break;
      }
    }
  }
  return poses;
}

}  // namespace

std::vector<MovingStretch> motionsOf(const std::vector<StampedTransform>& track, std::int64_t zero_ns) {
  std::vector<MovingStretch> motions;
  if (track.size() < 2) return motions;
  const Way way(track, zero_ns);
  bool gap = true;  // frames or tf are missing, so that the start of a motion is unknown
  for (std::size_t i = 1; i < track.size(); ++i) {
    const double from_s = secondsSince(zero_ns, track[i - 1].stamp_ns);
    const double to_s = secondsSince(zero_ns, track[i].stamp_ns);
    if (to_s - from_s > kFarthest_s) {
      if (!motions.empty() && motions.back().to_s > from_s - kRest_s) motions.pop_back();  // its end is unknown
      gap = true;
      continue;
    }
    if (way.speed_m_per_s(0.5 * (from_s + to_s)) < kSpeed_m_per_s) {
      gap = gap && (i < 2 || from_s - secondsSince(zero_ns, track[i - 2].stamp_ns) > kFarthest_s);
      continue;
    }
    if (!motions.empty() && from_s - motions.back().to_s < kRest_s) {
      motions.back().to_s = to_s;
    } else if (!gap) {
      motions.push_back({from_s, to_s});
    }
  }
  if (!motions.empty() && motions.back().to_s > secondsSince(zero_ns, track.back().stamp_ns) - kRest_s)
    motions.pop_back();
  motions.erase(std::remove_if(motions.begin(), motions.end(),
                               [&](const MovingStretch& m) {
                                 return (way.at(m.to_s + kSmooth_s) - way.at(m.from_s - kSmooth_s)).norm() <
                                        bounds::kLeastMotion_m;
                               }),
                motions.end());
  return motions;
}

namespace {

/// Medians of the changes of frames at rest and during motion.
struct UsualChanges {
  double still = 0, more = 0;  ///< at rest, and the excess during motion
};

std::optional<UsualChanges> usualChanges(const Way& way, const std::vector<MovingStretch>& motions,
                                         const std::vector<std::vector<FrameChange>>& changes) {
  std::vector<double> standing, moving;
  for (std::size_t g = 0; g < motions.size(); ++g) {
    const double middle_s = 0.5 * (motions[g].from_s + motions[g].to_s);
    for (const FrameChange& c : changes[g]) {
      const double quarter_s = 0.25 * (motions[g].to_s - motions[g].from_s);
      if (std::abs(c.at_s - middle_s) < quarter_s) {
        moving.push_back(c.change);
      } else if (way.moves(c.at_s, kSpeed_m_per_s) < kAtRest) {
        standing.push_back(c.change);
      }
    }
  }
  if (standing.empty() || moving.empty()) return std::nullopt;
  const double still = upperMedian(standing);
  return UsualChanges{still, upperMedian(moving) - still};
}

/// Delay of least misfit, and that misfit.
std::pair<double, double> leastOverLags(const std::function<double(double)>& misfit) {
  std::pair<double, double> best{std::numeric_limits<double>::infinity(), 0};
  for (int i = -static_cast<int>(kLongest_s / kStep_s); i <= static_cast<int>(kLongest_s / kStep_s); ++i) {
    best = std::min(best, {misfit(i * kStep_s), i * kStep_s});
  }
  return best;
}

/// Misfit of the changes of frames to a reported path with a delay.
class LagMisfit {
 public:
  LagMisfit(const Way& way, const UsualChanges& usual)
      : way_(way), least_(usual.still + std::max(kMoved * usual.more, kMovedOverStill * usual.still)) {}
  double operator()(const std::vector<FrameChange>& changes, double lag_s, double slow_m_per_s) const {
    double sum = 0;
    for (const FrameChange& c : changes) {
      sum += std::abs((c.change > least_ ? 1 : 0) - way_.moves(c.at_s + lag_s, slow_m_per_s));
    }
    return sum;
  }
  /// Slowest speed of kSlow_m_per_s that frames show, which depends on the radar and on tf.
  double slowestShown_m_per_s(const std::vector<std::vector<FrameChange>>& changes) const {
    double slow_m_per_s = kSpeed_m_per_s, least = std::numeric_limits<double>::infinity();
    for (double slow : kSlow_m_per_s) {
      const auto ofAll = [&](double lag_s) {
        double sum = 0;
        for (const std::vector<FrameChange>& about : changes) sum += (*this)(about, lag_s, slow);
        return sum;
      };
      const double value = leastOverLags(ofAll).first;
      if (value >= least) continue;
      least = value;
      slow_m_per_s = slow;
    }
    return slow_m_per_s;
  }

 private:
  const Way& way_;
  double least_;  ///< change that a radar at rest does not exceed; changes vary during motion
};

}  // namespace

std::optional<PoseTimeLag> findPoseTimeLag(const std::vector<StampedTransform>& track, std::int64_t zero_ns,
                                           const std::vector<MovingStretch>& motions,
                                           const std::vector<std::vector<FrameChange>>& changes, double period_s) {
  const Way way(track, zero_ns);
  const std::optional<UsualChanges> usual = usualChanges(way, motions, changes);
  if (!usual || usual->more < bounds::kLeastChangeOnTheWay) return std::nullopt;
  const LagMisfit misfit(way, *usual);
  const double slow_m_per_s = misfit.slowestShown_m_per_s(changes);
  PoseTimeLag result;
  std::vector<std::size_t> telling;
  for (std::size_t g = 0; g < motions.size(); ++g) {
    const double lag_s = leastOverLags([&](double s) { return misfit(changes[g], s, slow_m_per_s); }).second;
    if (changes[g].empty() || std::abs(lag_s) > kLongest_s - 2 * kStep_s) continue;
    telling.push_back(g);
    result.by_motion_s.push_back(lag_s);
  }
  const double n = static_cast<double>(telling.size());
  if (telling.size() < bounds::kFewestMotions) return std::nullopt;
  result.lag_s = upperMedian(result.by_motion_s);
  std::vector<double> off;
  for (double lag_s : result.by_motion_s) off.push_back(std::abs(lag_s - result.lag_s));
  // The error of a median is 1.25 times that of a mean. Two edges, each within a frame period, are no more accurate
  // than the second value.
  const double scatter_s = std::max(1.4826 * upperMedian(off), period_s / std::sqrt(24.0));
  result.standard_error_s = 1.25 * scatter_s / std::sqrt(n);
  for (std::size_t g : telling) {
    const double without = misfit(changes[g], 0, slow_m_per_s);
    const double with = misfit(changes[g], result.lag_s, slow_m_per_s);
    result.nats.push_back(static_cast<double>(changes[g].size()) * std::log(without / std::max(1e-9, with)));
  }
  const boost::math::students_t student(n - 1);
  result.false_alarm_rate =
      2 * boost::math::cdf(boost::math::complement(student, std::abs(result.lag_s) / result.standard_error_s));
  return result;
}

namespace {

/// Finding of a delay of the poses, beyond one that the twin states.
FrameFinding findingOf(const PoseTimeLag& lag, double stated_s) {
  FrameFinding finding;
  finding.cause = kName;
  const double value_s = stated_s + lag.lag_s;
  const boost::math::students_t student(static_cast<double>(lag.by_motion_s.size()) - 1);
  const double half_s = boost::math::quantile(student, 0.975) * lag.standard_error_s;
  finding.parameters = {{"lag_s", "s", value_s, {{value_s - half_s, value_s + half_s}}}};
  for (double nats : lag.nats) finding.log_likelihood_gain += nats;
  finding.false_alarm_rate = lag.false_alarm_rate;
  std::ostringstream text;
  text << std::setprecision(3) << "frames begin and end to change " << std::abs(lag.lag_s) << " s "
       << (lag.lag_s > 0 ? "before" : "after") << " tf says that the radar moves or stops, at "
       << lag.by_motion_s.size() << " moves; poses are looked up by that much " << (lag.lag_s > 0 ? "later" : "earlier")
       << " than frames' stamps here";
  if (stated_s != 0) text << ", beyond the " << stated_s << " s that the twin states";
  finding.description = text.str();
  return finding;
}

}  // namespace

TimedRecording inTime(const Recording& recording, const std::vector<NamedParameters>& stated,
                      const ReadingProgress& on_progress) {
  TimedRecording timed{recording, std::nullopt};
  if (recording.track.empty()) return timed;
  const auto reread = [&](double lag_s) {
    timed.recording = recording.withPoseLag(lag_s);
    timed.recording.channels = recording.channels;
  };
  const auto said =
      std::find_if(stated.begin(), stated.end(), [](const NamedParameters& m) { return m.mechanism == kName; });
  const double stated_s = said != stated.end() ? said->values.number("lag_s") : 0;
  if (stated_s != 0) reread(stated_s);
  const Recording& read = timed.recording;
  if (read.track.empty()) return timed;

  const std::int64_t zero_ns = read.track.front().stamp_ns;
  const std::vector<MovingStretch> motions = motionsOf(read.track, zero_ns);
  if (motions.size() < bounds::kFewestMotions) return timed;
  std::vector<std::vector<FrameChange>> changes;
  for (const MovingStretch& m : motions) {
    changes.push_back(changesBetween(read, zero_ns, m.from_s - kAround_s, m.to_s + kAround_s));
    if (on_progress) on_progress(changes.size(), motions.size());
  }
  const std::optional<PoseTimeLag> lag =
      findPoseTimeLag(read.track, zero_ns, motions, changes, read.radar.frame_period_s);
  if (!lag || lag->false_alarm_rate > bounds::kLagFalseAlarmRate || std::abs(lag->lag_s) < bounds::kLeastLag_s) {
    return timed;
  }

  FrameFinding f = findingOf(*lag, stated_s);
  f.poses = posesAfter(read, zero_ns, motions);
  reread(stated_s + lag->lag_s);
  timed.finding = std::move(f);
  return timed;
}

}  // namespace mmradartwin::diagnosis::channels
