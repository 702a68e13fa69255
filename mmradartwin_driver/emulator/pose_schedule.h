#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "played_session.h"

namespace mmradartwin {

/// When a pose is announced: its transform with this stamp.
struct ScheduledPose {
  std::int64_t stamp_ns;
  std::size_t pose;  ///< index in PlayedSession::poses
};

/// Start of pose i's first frame in a stream whose first frame starts at `start_ns`.
std::int64_t poseStart_ns(const PlayedSession& session, std::size_t i, std::int64_t start_ns);

/// Pose i with n frames from T_i on stands still from T_i - period/4 to T_i + (n - 1) period + period/4, announced at
/// both ends and at most `step_s` apart in between: all of its frames' stamps lie inside, and what interpolates between
/// two poses does so only in the half period between the last frame of the one and the first of the next.
std::vector<ScheduledPose> schedulePoses(const PlayedSession& session, std::int64_t start_ns, double step_s = 0.05);

}  // namespace mmradartwin
