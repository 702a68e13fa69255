#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "mmradartwin_dsp/session.h"

namespace mmradartwin {

/// Pose of the radar that is reported for a time; nothing where none is known.
using Trajectory = std::function<std::optional<Eigen::Isometry3d>(std::int64_t stamp_ns)>;

/// Along poses that follow each other closely, evenly from one to the next; at others the radar stands.
Trajectory trajectoryOf(std::vector<Pose> poses);

}  // namespace mmradartwin
