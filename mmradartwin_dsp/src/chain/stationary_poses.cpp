#include "mmradartwin_dsp/stationary_poses.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace mmradartwin {
namespace {

constexpr std::int64_t kLeastDuration_ns = 1000000000;
constexpr std::int64_t kLongestGap_ns = 1000000000;
constexpr double kSameLocation_m = 0.10;

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Median position, and the quaternion of median components with signs aligned: exact enough for a cluster of a degree.
Eigen::Isometry3d medianTransform(const StampedTransform* begin, const StampedTransform* end) {
  const Eigen::Quaterniond reference(begin->T_map_radar.linear());
  std::vector<double> values(static_cast<std::size_t>(end - begin));
  double result[7];
  for (int component = 0; component < 7; ++component) {
    for (const StampedTransform* frame = begin; frame != end; ++frame) {
      double value;
      if (component < 3) {
        value = frame->T_map_radar.translation()[component];
      } else {
        const Eigen::Quaterniond q(frame->T_map_radar.linear());
        value = q.coeffs()[component - 3] * (q.dot(reference) < 0 ? -1 : 1);
      }
      values[static_cast<std::size_t>(frame - begin)] = value;
    }
    result[component] = median(values);
  }
  const Eigen::Quaterniond q(result[6], result[3], result[4], result[5]);
  return Eigen::Translation3d(result[0], result[1], result[2]) * q.normalized();
}

/// Longest run of [begin, end) within the limits of `center`.
std::pair<const StampedTransform*, const StampedTransform*> longestRun(const StampedTransform* begin,
                                                                       const StampedTransform* end,
                                                                       const Eigen::Isometry3d& center) {
  auto best = std::make_pair(begin, begin);
  for (const StampedTransform* at = begin; at != end;) {
    if (!standsStill(at->T_map_radar, center)) {
      ++at;
      continue;
    }
    const StampedTransform* first = at;
    while (at != end && standsStill(at->T_map_radar, center)) ++at;
    if (at - first > best.second - best.first) best = {first, at};
  }
  return best;
}

}  // namespace

bool standsStill(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double distance_m, double angle_rad) {
  if ((a.translation() - b.translation()).norm() > distance_m) return false;
  return Eigen::Quaterniond(a.linear()).angularDistance(Eigen::Quaterniond(b.linear())) <= angle_rad;
}

std::vector<Stretch> findStationaryPoses(const std::vector<StampedTransform>& frames, std::int64_t frame_period_ns) {
  std::vector<Stretch> stretches;
  const StampedTransform* const end = frames.data() + frames.size();
  for (const StampedTransform* begin = frames.data(); begin != end;) {
    // Grow while the next frame is near the median so far; the median is renewed each time the stretch grows by a
    // tenth.
    Eigen::Isometry3d center = begin->T_map_radar;
    const StampedTransform* stop = begin + 1;
    std::ptrdiff_t renew_at = 2;
    while (stop != end && stop->stamp_ns - (stop - 1)->stamp_ns <= kLongestGap_ns &&
           standsStill(stop->T_map_radar, center)) {
      ++stop;
      if (stop - begin >= renew_at) {
        center = medianTransform(begin, stop);
        renew_at = (stop - begin) + std::max<std::ptrdiff_t>(1, (stop - begin) / 10);
      }
    }
    center = medianTransform(begin, stop);
    auto run = longestRun(begin, stop, center);
    // The median of the run differs a little from that of all; twice settles it but for frames on the limit itself.
    if (run.first != run.second) run = longestRun(run.first, run.second, medianTransform(run.first, run.second));
    if (run.first == run.second ||
        (run.second - 1)->stamp_ns - run.first->stamp_ns + frame_period_ns < kLeastDuration_ns) {
      ++begin;
      continue;
    }
    Stretch stretch;
    stretch.pose.stamp_ns = run.first->stamp_ns;
    stretch.pose.T_map_radar = medianTransform(run.first, run.second);
    stretch.last_stamp_ns = (run.second - 1)->stamp_ns;
    char name[16];
    std::snprintf(name, sizeof name, "%03d", static_cast<int>(stretches.size()) + 1);
    stretch.pose.name = name;
    stretches.push_back(stretch);
    begin = run.second;
  }
  std::vector<Eigen::Vector2d> spots;
  for (Stretch& stretch : stretches) {
    const Eigen::Vector2d at = stretch.pose.T_map_radar.translation().head<2>();
    const auto spot = std::find_if(spots.begin(), spots.end(),
                                   [&](const Eigen::Vector2d& s) { return (s - at).norm() <= kSameLocation_m; });
    stretch.pose.location = std::to_string(spot - spots.begin() + 1);
    if (spot == spots.end()) spots.push_back(at);
  }
  return stretches;
}

}  // namespace mmradartwin
