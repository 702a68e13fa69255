#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// When a fit of a camera's cloud to the scene is to be believed, and how it is searched for.
struct RegistrationOptions {
  double min_depth_m = 0.3, max_depth_m = 4.0;  ///< of the points in use, along the ray
  /// Standard deviation of a measured distance r: depth_noise_per_m r^2 (a stereo camera's law; D435i 0.004).
  double depth_noise_per_m = 0.004;
  double scene_error_m = 0.02;  ///< how far the scene's surfaces may stand from the room's
  /// A first fix is looked for within this of the guess, horizontally, and within this turn.
  double search_m = 0.8, search_rad = 0.6;
  double max_step_m = 0.5, max_step_rad = 0.35;  ///< from the last pose, while tracking
  double min_agreement = 0.8;                    ///< share of points that stand where the scene has a surface
  double max_behind = 0.08;        ///< share of points behind a surface of the scene: nothing can be seen there
  double min_coverage = 0.6;       ///< share of points in whose direction the scene has anything at all
  double min_information = 0.004;  ///< of the weakest of the six directions, 1/6 where all are alike
  double max_std_m = 0.02, max_std_rad = 0.009;
  double max_tilt_rad = 0.05;  ///< between the fit's vertical and gravity's
  int min_points = 300;        ///< cells of 1.5 deg of the camera's view
};

/// Result of fitting a cloud to the room.
struct Registration {
  bool trusted = false;
  std::string reason;  ///< why it is not trusted and what to do; "" where it is
  Eigen::Isometry3d T_map_camera = Eigen::Isometry3d::Identity();
  /// x, y, z [m], turns about map's x, y, z axes through the camera [rad]. From the residuals themselves, those within
  /// 0.5 m of each other taken as one: errors of a scene are alike over a surface.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  double rms_m = 0;  ///< distance of agreeing points from the scene's surfaces
  double agreement = 0, behind = 0, before = 0, coverage = 0;  ///< shares, see RegistrationOptions
  double information = 0;                                      ///< see RegistrationOptions::min_information
  Eigen::Matrix<double, 6, 1> weakest = Eigen::Matrix<double, 6, 1>::Zero();  ///< the least certain direction
  int points = 0, starts = 0;
};

enum class GuessKind {
  kPerson,   ///< a first fix: several starts around the guess
  kTracking  ///< the last trusted pose: one start; more around it where the cloud does not fit from there
};

/// Registers clouds of a depth camera to a scene: trimmed point-to-plane ICP on points sampled from what is visible of
/// the mesh, then a verdict by casting the camera's own rays. Const functions may be called from several threads at
/// once. Deterministic.
class RoomRegistration {
 public:
  /// The scene must outlive it. Throws InputError where the scene has no surface.
  explicit RoomRegistration(const Scene& scene, const RegistrationOptions& options = {});
  ~RoomRegistration();
  RoomRegistration(RoomRegistration&&) noexcept;

  /// cloud_camera: points in the camera's frame (x forward, y left, z up), any order; NaNs are left out. up_camera:
  /// opposite to gravity in that frame, where it is known. The guess's tilt is replaced by it.
  Registration locate(const std::vector<Eigen::Vector3d>& cloud_camera, const Eigen::Isometry3d& guess, GuessKind kind,
                      const std::optional<Eigen::Vector3d>& up_camera = std::nullopt) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Which way is up, of an accelerometer at rest: the mean over the last half second, nothing while the sensor moves.
class GravityEstimate {
 public:
  /// Specific force [m/s^2] and turn rate [rad/s], both in the same frame.
  void add(double stamp_s, const Eigen::Vector3d& acceleration, const Eigen::Vector3d& turn_rate);
  /// Unit vector; nothing where fewer than ten samples are there, the newest is older than half a second, or the
  /// samples say that the sensor was moved.
  std::optional<Eigen::Vector3d> up(double stamp_s) const;

 private:
  struct Sample {
    double stamp_s;
    Eigen::Vector3d acceleration, turn_rate;
  };
  std::vector<Sample> samples_;
};

}  // namespace mmradartwin
