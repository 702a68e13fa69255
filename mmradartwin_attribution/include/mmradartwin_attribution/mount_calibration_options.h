#pragma once

namespace mmradartwin {

struct MountCalibrationOptions {
  double search_m = 0.4;            ///< the target's echo is looked for within this of where the pose puts it
  double search_rad = 0.44;         ///< greatest yaw of the mount that is looked for, to either side
  double min_level_db = 12;         ///< of the target's echo over the pose's median range bin
  double max_azimuth_rad = 1.05;    ///< poses that hold the target further off boresight are left out
  double most_other_db = -20;       ///< echoes of other things in a wall's range cell, by the scene, against the wall's
  double most_beside_db = -6;       ///< those beside it, within search_m
  double max_laser_error_m = 0.02;  ///< between a laser's distance and the pose's, a common mount offset apart
};

}  // namespace mmradartwin
