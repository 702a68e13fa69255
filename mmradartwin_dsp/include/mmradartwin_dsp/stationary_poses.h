#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "mmradartwin_dsp/session.h"

namespace mmradartwin {

/// True within 2 cm and 1 deg: the radar stands still.
bool standsStill(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double distance_m = 0.02,
                 double angle_rad = M_PI / 180);

/// A stretch of frames [first, last] of one pose.
struct Stretch {
  Pose pose;  ///< T_map_radar is the stretch's median
  std::int64_t last_stamp_ns = 0;
};

/// Finds the stretches of at least 1 s in which T_map_radar stays within 2 cm and 1 deg of its median
/// (docs/reference/contracts.md section 5). `frames` in order of time; a gap of more than 1 s ends a stretch. Poses are
/// named 001, 002, ...; those within 10 cm horizontally of a location's first pose share it.
std::vector<Stretch> findStationaryPoses(const std::vector<StampedTransform>& frames, std::int64_t frame_period_ns);

}  // namespace mmradartwin
