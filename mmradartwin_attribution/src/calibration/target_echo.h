#pragma once

#include <Eigen/Geometry>
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_attribution/calibration_target.h"
#include "mmradartwin_attribution/mount_calibration_options.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// Geometry of the target from one pose.
struct TargetPaths {
  double range_m = 0;            ///< from the radar's origin
  Eigen::Vector3d direction;     ///< unit, radar_link
  std::vector<double> length_m;  ///< [M] TX to target to RX
};
/// Nothing where no facet of the wall is faced.
std::optional<TargetPaths> targetPaths(const RadarConfig& radar, const CalibrationTarget& target,
                                       const Eigen::Isometry3d& T_map_radar);

/// exp(j phase) of the channels at the window's centre, against a path of twice range_m.
Eigen::VectorXcd steering(const RadarConfig& radar, const TargetPaths& paths);

/// The target's echo in one measured grid.
struct TargetEcho {
  std::string pose;
  Eigen::Isometry3d T_map_radar;
  double range_m = 0, level_db = 0;
  Eigen::VectorXcd channels;  ///< [M], unit norm
};
/// Throws InputError, which says what is in the way, where the twin expects no echo of the target's wall at this pose,
/// or others that the radar cannot tell from it. Nothing is known of a corner reflector: it is no part of a scene.
void requireClearEcho(const Twin& twin, const CalibrationTarget& target, const Pose& pose,
                      const MountCalibrationOptions& options);
/// The strongest tone within search_m of where the pose puts the target. Throws InputError that says why there is none.
TargetEcho findEcho(const RadarConfig& radar, const CalibrationTarget& target, const Pose& pose,
                    const ReceiveGrid& grid, const MountCalibrationOptions& options);

}  // namespace mmradartwin
