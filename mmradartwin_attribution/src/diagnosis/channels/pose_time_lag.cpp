#include "diagnosis/channels/pose_time_lag.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <functional>
#include <iomanip>
#include <limits>
#include <sstream>
#include <utility>

#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::channels {
namespace {

const std::string kName = "pose_time_lag";
constexpr double kLongest_s = 1;         ///< lag that is looked for
constexpr double kStep_s = 0.005;        ///< between lags that are tried
constexpr double kAround_s = 1.2;        ///< of a motion's ends, what is read
constexpr double kSpeed_m_per_s = 0.05;  ///< of a radar that moves; tf of visual odometry trembles by less
constexpr double kSmooth_s = 0.1;        ///< to either side, over which speeds are taken
constexpr double kRest_s = 0.5;          ///< a shorter stop is a part of the motion
constexpr double kFarthest_s = 0.3;      ///< between frames that follow each other
constexpr double kFar_m = 0.05;
constexpr std::size_t kFewestMotions = 3;
constexpr double kSlow_m_per_s[] = {0.01, 0.02, 0.05};
constexpr double kMoved = 0.05, kMovedMore = 4;  ///< of what is changed on the way, and of what is while it stands
constexpr double kTellingChange = 0.1;           ///< on the way, beyond that of a radar that stands
constexpr double kLeast_s = 0.02;                ///< what stamps of two computers' clocks differ by at best
constexpr double kFalseAlarm = 0.01;
constexpr double kNear_m = 0.3;  ///< what leaks within the radar moves along with it

double secondsSince(std::int64_t zero_ns, std::int64_t stamp_ns) {
  return 1e-9 * static_cast<double>(stamp_ns - zero_ns);
}

/// Where the radar is reported to be at any time: linear between frames, the first and last one's beyond them.
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
  /// 0 where it stands, 1 where it moves much faster than that.
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

/// How long after its stamp a frame's middle is. What the chirps last at least, where radar.yaml does not say how long.
double halfFrame_s(const RadarConfig& radar) {
  const double sampled_s = radar.adc_start_s + radar.samples_per_chirp / radar.sample_rate_hz;
  const double said_s = radar.idle_s + radar.ramp_end_s;
  return 0.5 * radar.chirps_per_frame() * (std::isnan(said_s) ? sampled_s : said_s);
}

/// Of the frames from one time to another, those that follow each other.
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
  bool gap = true;  // frames or tf are missing: nothing is known of how it began
  for (std::size_t i = 1; i < track.size(); ++i) {
    const double from_s = secondsSince(zero_ns, track[i - 1].stamp_ns);
    const double to_s = secondsSince(zero_ns, track[i].stamp_ns);
    if (to_s - from_s > kFarthest_s) {
      if (!motions.empty() && motions.back().to_s > from_s - kRest_s) motions.pop_back();  // it did not come to an end
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
                                 return (way.at(m.to_s + kSmooth_s) - way.at(m.from_s - kSmooth_s)).norm() < kFar_m;
                               }),
                motions.end());
  return motions;
}

std::optional<PoseTimeLag> findPoseTimeLag(const std::vector<StampedTransform>& track, std::int64_t zero_ns,
                                           const std::vector<MovingStretch>& motions,
                                           const std::vector<std::vector<FrameChange>>& changes, double period_s) {
  const Way way(track, zero_ns);
  std::vector<double> standing, moving;
  for (std::size_t g = 0; g < motions.size(); ++g) {
    const double middle_s = 0.5 * (motions[g].from_s + motions[g].to_s);
    for (const FrameChange& c : changes[g]) {
      const double quarter_s = 0.25 * (motions[g].to_s - motions[g].from_s);
      if (std::abs(c.at_s - middle_s) < quarter_s) {
        moving.push_back(c.change);
      } else if (way.moves(c.at_s, kSpeed_m_per_s) < 0.1) {
        standing.push_back(c.change);
      }
    }
  }
  if (standing.empty() || moving.empty()) return std::nullopt;
  const double still = upperMedian(standing), more = upperMedian(moving) - still;
  if (more < kTellingChange) return std::nullopt;

  // On the way it is now more and now less: any change that a radar at rest does not show is one.
  const double least = still + std::max(kMoved * more, kMovedMore * still);
  const auto misfit = [&](const std::vector<FrameChange>& about, double lag_s, double slow_m_per_s) {
    double sum = 0;
    for (const FrameChange& c : about) {
      sum += std::abs((c.change > least ? 1 : 0) - way.moves(c.at_s + lag_s, slow_m_per_s));
    }
    return sum;
  };
  const auto leastOver = [&](const std::function<double(double)>& value) {
    std::pair<double, double> best{std::numeric_limits<double>::infinity(), 0};
    for (int i = -static_cast<int>(kLongest_s / kStep_s); i <= static_cast<int>(kLongest_s / kStep_s); ++i) {
      best = std::min(best, {value(i * kStep_s), i * kStep_s});
    }
    return best;
  };
  // How slow a motion frames still show is the radar's matter and tf's.
  double slow_m_per_s = kSpeed_m_per_s, fits = std::numeric_limits<double>::infinity();
  for (double slow : kSlow_m_per_s) {
    const auto ofAll = [&](double lag_s) {
      double sum = 0;
      for (const std::vector<FrameChange>& about : changes) sum += misfit(about, lag_s, slow);
      return sum;
    };
    const double value = leastOver(ofAll).first;
    if (value >= fits) continue;
    fits = value;
    slow_m_per_s = slow;
  }
  PoseTimeLag result;
  std::vector<std::size_t> telling;
  for (std::size_t g = 0; g < motions.size(); ++g) {
    const double lag_s = leastOver([&](double s) { return misfit(changes[g], s, slow_m_per_s); }).second;
    if (changes[g].empty() || std::abs(lag_s) > kLongest_s - 2 * kStep_s) continue;
    telling.push_back(g);
    result.by_motion_s.push_back(lag_s);
  }
  const double n = static_cast<double>(telling.size());
  if (telling.size() < kFewestMotions) return std::nullopt;
  result.lag_s = upperMedian(result.by_motion_s);
  std::vector<double> off;
  for (double lag_s : result.by_motion_s) off.push_back(std::abs(lag_s - result.lag_s));
  // A median's error is 1.25 of a mean's. Two edges, each within a frame period, know no better than that.
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
  if (motions.size() < kFewestMotions) return timed;
  std::vector<std::vector<FrameChange>> changes;
  for (const MovingStretch& m : motions) {
    changes.push_back(changesBetween(read, zero_ns, m.from_s - kAround_s, m.to_s + kAround_s));
    if (on_progress) on_progress(changes.size(), motions.size());
  }
  const std::optional<PoseTimeLag> lag =
      findPoseTimeLag(read.track, zero_ns, motions, changes, read.radar.frame_period_s);
  if (!lag || lag->false_alarm_rate > kFalseAlarm || std::abs(lag->lag_s) < kLeast_s) return timed;

  FrameFinding f;
  f.cause = kName;
  const double value_s = stated_s + lag->lag_s;
  const boost::math::students_t student(static_cast<double>(lag->by_motion_s.size()) - 1);
  const double half_s = boost::math::quantile(student, 0.975) * lag->standard_error_s;
  f.parameters = {{"lag_s", "s", value_s, {{value_s - half_s, value_s + half_s}}}};
  for (double nats : lag->nats) f.log_likelihood_gain += nats;
  f.false_alarm_rate = lag->false_alarm_rate;
  f.poses = posesAfter(read, zero_ns, motions);
  std::ostringstream said_in_words;
  said_in_words << std::setprecision(3) << "frames begin and end to change " << std::abs(lag->lag_s) << " s "
                << (lag->lag_s > 0 ? "before" : "after") << " tf says that the radar moves or stops, at "
                << lag->by_motion_s.size() << " moves; poses are looked up by that much "
                << (lag->lag_s > 0 ? "later" : "earlier") << " than frames' stamps here";
  if (stated_s != 0) said_in_words << ", beyond the " << stated_s << " s that the twin states";
  f.description = said_in_words.str();
  reread(value_s);
  timed.finding = std::move(f);
  return timed;
}

}  // namespace mmradartwin::diagnosis::channels
