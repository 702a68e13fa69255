#include "pose_schedule.h"

#include <algorithm>
#include <cmath>

namespace mmradartwin {

std::int64_t poseStart_ns(const PlayedSession& session, std::size_t i, std::int64_t start_ns) {
  return start_ns + session.radar.frame_offset_ns(session.poses[i].first_frame);
}

std::vector<ScheduledPose> schedulePoses(const PlayedSession& session, std::int64_t start_ns, double step_s) {
  std::vector<ScheduledPose> schedule;
  const std::int64_t quarter_ns = session.radar.frame_offset_ns(1) / 4;
  for (std::size_t i = 0; i < session.poses.size(); ++i) {
    const std::int64_t first_ns = poseStart_ns(session, i, start_ns);
    const std::int64_t begin_ns = first_ns - quarter_ns;
    const std::int64_t length_ns = session.radar.frame_offset_ns(session.poses[i].frames - 1) + 2 * quarter_ns;
    const auto steps =
        std::max<std::int64_t>(1, std::llround(std::ceil(static_cast<double>(length_ns) / (step_s * 1e9))));
    for (std::int64_t k = 0; k <= steps; ++k) schedule.push_back({begin_ns + length_ns * k / steps, i});
  }
  return schedule;
}

}  // namespace mmradartwin
