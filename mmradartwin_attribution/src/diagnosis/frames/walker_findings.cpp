#include "diagnosis/frames/walker_findings.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>

#include "diagnosis/catalogue/bounds.h"

namespace mmradartwin::diagnosis::frames {
namespace {

constexpr double kSameBody_m = 0.6;          ///< between the end of a track and the beginning of its continuation
constexpr double kUsualSpeed_m_per_s = 2.0;  ///< of people in rooms, unseen
constexpr double kOverlap = 0.34;  ///< share of the shorter of two stretches of one way, in which both are seen
constexpr double kMostToldAcross_m_per_s = 3;  ///< of people; an interval beyond it tells nothing
constexpr double kAroundTrack_m = 0.5;         ///< about a track, in a finding's place
constexpr double kAroundTrack_deg = 10;
constexpr double kTrackRangeError_m = 0.1;      ///< standard error along the view, about a range bin
constexpr double kTrackAngleError_rad = 0.035;  ///< standard error across the view: 2 inDegrees, the array's errors

double inDegrees(double rad) { return rad * 180 / M_PI; }

/// Track in the map and in time.
struct Step {
  const Pose* pose;
  const WalkTrack* track;
  double begin_s, end_s;  ///< after the session's first pose
  Eigen::Vector2d begin, middle, end;
};

Eigen::Vector2d inMap(const Pose& pose, const Eigen::Vector2d& range_and_azimuth) {
  const double r = range_and_azimuth[0], a = range_and_azimuth[1];
  return (pose.T_map_radar * Eigen::Vector3d(r * std::cos(a), r * std::sin(a), 0)).head<2>();
}

/// True where one body can have walked both.
bool continues(const Step& earlier, const Step& later) {
  const double gap_s = std::max(0.0, later.begin_s - earlier.end_s), overlap_s = earlier.end_s - later.begin_s;
  // Where someone turns back, both stretches reach into the turn.
  const double shorter_s = std::min(earlier.end_s - earlier.begin_s, later.end_s - later.begin_s);
  return overlap_s <= kOverlap * shorter_s &&
         (later.begin - earlier.end).norm() < kSameBody_m + kUsualSpeed_m_per_s * gap_s;
}

using Person = std::vector<Step>;  ///< in order of time

/// Steps in as few people as can have walked them; each goes on where the nearest one stopped.
std::vector<Person> peopleOf(std::vector<Step> steps) {
  std::stable_sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) { return a.begin_s < b.begin_s; });
  std::vector<Person> people;
  for (const Step& step : steps) {
    Person* nearest = nullptr;
    for (Person& person : people) {
      if (!continues(person.back(), step)) continue;
      if (!nearest || (step.begin - person.back().end).norm() < (step.begin - nearest->back().end).norm()) {
        nearest = &person;
      }
    }
    if (nearest) {
      nearest->push_back(step);
    } else {
      people.push_back({step});
    }
  }
  return people;
}

/// Mean of several numbers with errors of their own, whose error grows where they disagree (Birge).
Bounded meanOf(const std::vector<Bounded>& numbers) {
  double weights = 0, sum = 0, low = 0, high = 0;
  for (const Bounded& n : numbers) {
    const double half = std::max(1e-6, 0.5 * (n.high - n.low)), weight = 1 / (half * half);
    weights += weight;
    sum += weight * n.value;
    low += weight * (n.value - n.low);
    high += weight * (n.high - n.value);
  }
  const double mean = sum / weights;
  double chi2 = 0;
  for (const Bounded& n : numbers)
    chi2 += std::pow(1.96 * (n.value - mean) / std::max(1e-6, 0.5 * (n.high - n.low)), 2);
  const double several = static_cast<double>(numbers.size());
  const double wider = several > 1 ? std::sqrt(std::max(1.0, chi2 / (several - 1))) : 1.0;
  const double narrower = wider / std::sqrt(several);
  return {mean, mean - narrower * low / weights, mean + narrower * high / weights};
}

/// Speed over ground of a track: what it shows across the view counts where it exceeds its error.
std::optional<Bounded> speedOf(const WalkTrack& t) {
  if (!t.radial) return std::nullopt;
  const Bounded& radial = *t.radial;
  const double across = std::abs(t.across_m_per_s), half = 1.96 * t.across_error_m_per_s;
  if (half > kMostToldAcross_m_per_s) return std::nullopt;
  const double told = across > half ? across : 0;
  Bounded speed;
  speed.value = std::hypot(radial.value, told);
  const bool turns = radial.low < 0 && radial.high > 0;
  const double least = turns ? 0 : std::min(std::abs(radial.low), std::abs(radial.high));
  speed.low = std::hypot(least, std::max(0.0, across - half));
  speed.high = std::hypot(std::max(std::abs(radial.low), std::abs(radial.high)), across + half);
  return speed;
}

void addPlace(const Step& s, const RadarConfig& radar, FrameFinding& finding) {
  FindingPlace place;
  const double first_s = s.track->first_frame * radar.frame_period_s,
               last_s = s.track->last_frame * radar.frame_period_s;
  const Eigen::Vector2d begin = s.track->at(first_s), end = s.track->at(last_s);
  place.range_m = {std::max(0.0, std::min(begin[0], end[0]) - kAroundTrack_m),
                   std::max(begin[0], end[0]) + kAroundTrack_m};
  place.azimuth_deg = {inDegrees(std::min(begin[1], end[1])) - kAroundTrack_deg,
                       inDegrees(std::max(begin[1], end[1])) + kAroundTrack_deg};
  place.poses = {s.pose->name};
  place.x_m = s.middle.x();
  place.y_m = s.middle.y();
  finding.where.push_back(place);
  if (finding.poses.empty() || finding.poses.back() != s.pose->name) finding.poses.push_back(s.pose->name);
}

/// Place of the strongest track, with its interval: along and across the view.
void addPosition(const Step& s, FrameFinding& finding) {
  const Eigen::Vector2d ray = s.middle - s.pose->T_map_radar.translation().head<2>();
  const double range_m = std::max(0.1, ray.norm());
  const Eigen::Vector2d along = ray / range_m, across(-along.y(), along.x());
  const double across_m = kTrackAngleError_rad * range_m;
  const Eigen::Vector2d half =
      1.96 * (along.cwiseAbs2() * kTrackRangeError_m * kTrackRangeError_m + across.cwiseAbs2() * across_m * across_m)
                 .cwiseSqrt();
  finding.parameters.push_back({"x_m", "m", s.middle.x(), {{s.middle.x() - half.x(), s.middle.x() + half.x()}}});
  finding.parameters.push_back({"y_m", "m", s.middle.y(), {{s.middle.y() - half.y(), s.middle.y() + half.y()}}});
}

/// Speeds of a person, NaN without an interval where no recording tells them.
void addSpeeds(const Person& person, const Step& strongest, FrameFinding& finding) {
  std::vector<Bounded> speeds;
  for (const Step& s : person) {
    if (const std::optional<Bounded> speed = speedOf(*s.track)) speeds.push_back(*speed);
  }
  FindingParameter speed{"speed_m_per_s", "m/s", std::numeric_limits<double>::quiet_NaN(), {}};
  if (!speeds.empty()) {
    const Bounded mean = meanOf(speeds);
    speed.value = mean.value;
    speed.ci95 = {{std::max(0.0, mean.low), mean.high}};
  }
  FindingParameter radial{"radial_m_per_s", "m/s", std::numeric_limits<double>::quiet_NaN(), {}};
  if (strongest.track->radial) {
    radial.value = strongest.track->radial->value;
    radial.ci95 = {{strongest.track->radial->low, strongest.track->radial->high}};
  }
  finding.parameters.push_back(speed);
  finding.parameters.push_back(radial);
}

/// The way of a person through the frames of the pose that sees it best.
void addTrack(const Person& person, const Step& strongest, const RadarConfig& radar, FrameFinding& finding) {
  std::vector<double> time_s, x_m, y_m;
  for (const Step& s : person) {
    if (s.pose != strongest.pose) continue;
    for (int f = s.track->first_frame; f <= s.track->last_frame; ++f) {
      const double t = f * radar.frame_period_s;
      const Eigen::Vector2d place = inMap(*s.pose, s.track->at(t));
      const auto rounded = [](double value) { return std::round(1e4 * value) / 1e4; };
      time_s.push_back(rounded(t));
      x_m.push_back(rounded(place.x()));
      y_m.push_back(rounded(place.y()));
    }
  }
  finding.parameters.push_back({"track_time_s", "s", time_s, {}});
  finding.parameters.push_back({"track_x_m", "m", x_m, {}});
  finding.parameters.push_back({"track_y_m", "m", y_m, {}});
}

std::string wordsOf(const Person& person, const Step& strongest) {
  const WalkTrack& t = *strongest.track;
  std::ostringstream text;
  text << "someone walks at (" << strongest.middle.x() << ", " << strongest.middle.y() << ") m in the map, at "
       << t.range_m << " m and " << inDegrees(t.azimuth_rad) << " deg of pose " << strongest.pose->name;
  if (t.radial) {
    text << ", " << (t.radial->value > 0 ? "away from" : "towards") << " the radar at " << std::abs(t.radial->value)
         << " m/s";
  } else {
    text << "; this recording does not tell " << t.radial_m_per_s;
    for (double other : t.other_m_per_s) text << " from " << other;
    text << " m/s along the line of sight: record more frames or shorter loops";
  }
  text << ", from frame " << t.first_frame << " to " << t.last_frame;
  if (person.size() > 1) text << "; " << person.size() << " stretches of the way are seen";
  return text.str();
}

FrameFinding findingOf(const Person& person, const RadarConfig& radar) {
  FrameFinding finding;
  finding.cause = "moving_target";
  finding.false_alarm_rate = bounds::kDopplerFalseAlarmRate;
  const Step& strongest = *std::max_element(person.begin(), person.end(),
                                            [](const Step& a, const Step& b) { return a.track->nats < b.track->nats; });
  for (const Step& s : person) {
    finding.log_likelihood_gain += s.track->nats;
    finding.nats_by_pose[s.pose->name] += s.track->nats;
    addPlace(s, radar, finding);
  }
  addPosition(strongest, finding);
  addSpeeds(person, strongest, finding);
  addTrack(person, strongest, radar, finding);
  finding.description = wordsOf(person, strongest);
  return finding;
}

}  // namespace

std::vector<FrameFinding> walkerFindings(const RadarConfig& radar, const std::vector<PoseTracks>& poses) {
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max();
  for (const PoseTracks& p : poses) first_ns = std::min(first_ns, p.pose->stamp_ns);
  std::vector<Step> steps;
  for (const PoseTracks& p : poses) {
    const double pose_s = 1e-9 * static_cast<double>(p.pose->stamp_ns - first_ns);
    for (const WalkTrack& t : *p.tracks) {
      const double first_s = t.first_frame * radar.frame_period_s, last_s = t.last_frame * radar.frame_period_s;
      steps.push_back({p.pose, &t, pose_s + first_s, pose_s + last_s, inMap(*p.pose, t.at(first_s)),
                       inMap(*p.pose, t.at(t.middle_s)), inMap(*p.pose, t.at(last_s))});
    }
  }
  std::vector<FrameFinding> findings;
  for (const Person& person : peopleOf(std::move(steps))) findings.push_back(findingOf(person, radar));
  std::stable_sort(findings.begin(), findings.end(),
                   [](const auto& a, const auto& b) { return a.log_likelihood_gain > b.log_likelihood_gain; });
  return findings;
}

}  // namespace mmradartwin::diagnosis::frames
