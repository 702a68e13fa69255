#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_sim/ray_caster.h"
#include "mmradartwin_sim/scatter_cells.h"
#include "mmradartwin_sim/scene.h"
#include "mmradartwin_sim/scene_change.h"

namespace mmradartwin {

constexpr double kBaseElevation_deg = 20;
/// Field of view of emission and arrival: |azimuth| < 90 deg, |elevation| <= most_elevation_deg of a direction in
/// radar_link. The base has kBaseElevation_deg.
bool inFieldOfView(const Eigen::Vector3d& direction_radar, double most_elevation_deg = kBaseElevation_deg);

/// Everything a mechanism may look at for one pose.
struct PoseContext {
  const RadarConfig& radar;
  const Scene& scene;
  const RayCaster& rays;
  Eigen::Isometry3d T_map_radar;  ///< where the twin's radar is, after all pose() calls
  double frequency_hz;            ///< of the coefficients: the window's centre
  bool inFieldOfView(const Eigen::Vector3d& direction_radar) const;  ///< the free function, with most_elevation_deg
  double max_range_m;                                                ///< paths with length/2 beyond are left out
  std::uint64_t seed;  ///< of what is random by nature (phases of scatter points)
  /// Strongest A_p of the session's poses, for levels that are relative to it.
  std::function<double()> strongest_amplitude;
  double delay_m = 0;      ///< WeightStage::delay_m() of all weights; in DistortionStage alone
  double paths_power = 0;  ///< sum of A_p^2 over the pose's paths before any weight; in WeightStage alone
  /// |gain| of the receiver's filters at a path length: what a level stated after the IF filter has to make up for.
  std::function<double(double length_m)> receiver_gain;
  /// When the pose was taken: after the session's first pose, and its place among the session's poses in time order.
  /// Zero, and 0 of 1, where no session is known (Twin::setSession).
  double session_s = 0;
  int pose_index = 0, pose_count = 1;
  /// Change since the pose's paths were found: only paths that it touches are asked for (PathStage::tracesChanges).
  /// Null where all are.
  const SceneChange* change = nullptr;
  const ScatterCells* cloud = nullptr;  ///< null: every scatter point is a path
  /// Only paths that meet this actor (index in `scene`) are wanted; others that are added are thrown away. -1: all
  /// paths are wanted.
  int only_actor = -1;
  double most_elevation_deg = kBaseElevation_deg;  ///< a mechanism may look farther up and down, in a copy
};

}  // namespace mmradartwin
