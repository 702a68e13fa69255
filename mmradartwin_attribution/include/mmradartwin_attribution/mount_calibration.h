#pragma once

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mmradartwin_attribution/calibration_target.h"
#include "mmradartwin_attribution/mount_calibration_options.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// Distance from the radar's origin to the target, as a laser meter gave it (to a wall: perpendicular).
struct LaserDistance {
  std::string pose;
  double distance_m;
};
/// Reads CSV `pose,distance_m`. Throws InputError (unknown header, no number, pose given twice).
std::vector<LaserDistance> readLaserDistances(const std::string& file);

/// A value with its 95 % interval. Values that the poses do not fix are 0 and say so.
struct CalibratedValue {
  std::string name, unit;  ///< as in the twin's mechanisms
  double value = 0;
  std::array<double, 2> ci95 = {0, 0};
  bool observable = true;
  std::string note;
};

struct CalibratedPose {
  std::string name;
  bool used = false;
  std::string why_not;
  double azimuth_deg = 0;                            ///< of the target in the radar's frame, from the calibrated pose
  double range_m = 0;                                ///< measured one-way range
  double level_db = 0;                               ///< over the pose's median range bin
  std::array<double, 2> range_error_m = {0, 0};      ///< measured minus expected, before and after
  std::array<double, 2> azimuth_error_deg = {0, 0};  ///< measured minus expected, before and after
  std::vector<double> channel_error_deg[2];          ///< [M] phase against the expected, mean taken out
};

struct MountCalibration {
  CalibratedValue yaw_deg, forward_m, left_m, range_m;
  std::vector<CalibratedValue> phase_deg, gain_db;  ///< [M], channel 0 is 0
  std::vector<CalibratedPose> poses;
  std::vector<PoseProblem> problems;
  std::vector<std::string> notes;  ///< what cannot be known, a line each
  std::string undetermined;        ///< why yaw or channels are not fixed, and what would fix them; empty where they are
  bool lasers = false;
};

/// Fits the radar's mount (yaw, forward, left: true minus reported, in the reported radar frame), range bias and
/// channel errors to the target's echo in a few poses. Only delay, phase between channels and power count: each pose's
/// absolute phase and level are free. Intervals come from the scatter of the poses (Student's t), with a heading error
/// and a range error of each pose's own. Throws InputError where fewer than three poses show the target, and where a
/// laser's distance contradicts its pose (names it). With a twin, poses at which something else hides a wall or shares
/// its range cell are left out and listed. Yaw and channels whose intervals are too wide to be of use, as before a
/// rough wall, are not given: `undetermined` says so. `progress` is told poses done.
MountCalibration calibrateMount(const Recording& recording, const CalibrationTarget& target,
                                const std::vector<LaserDistance>& lasers, const MountCalibrationOptions& options = {},
                                const Twin* twin = nullptr, const std::function<void(int)>& progress = {});

/// Errors of range, azimuth and channel phases, pose by pose, before and after.
cv::Mat drawCalibration(const MountCalibration& calibration);
/// calibration.yaml: every value with unit and interval, and the poses.
std::string toYaml(const MountCalibration& calibration);
/// camera_link -> radar_link with the calibrated mount: the reported one times the offsets.
Eigen::Isometry3d correctedMount(const MountCalibration& calibration, const Eigen::Isometry3d& T_camera_radar);

}  // namespace mmradartwin
