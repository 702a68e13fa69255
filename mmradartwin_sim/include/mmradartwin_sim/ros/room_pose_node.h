#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_broadcaster.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "mmradartwin_dsp/ros/node_program.h"
#include "mmradartwin_dsp/ros/transform_reader.h"
#include "mmradartwin_sim/room_registration.h"

namespace mmradartwin {

/// cloud, imu, initialpose, tf (camera_link -> frames of the sensors) -> tf map -> camera_link, room_pose, diagnostics.
///
/// Every cloud is registered to the scene from the last trusted pose. Before the first one, and after `lost_after_s`
/// without any, it is registered from rviz's 2D Pose Estimate (topic initialpose, whose height is `camera_height_m`) or
/// from the parameter `initial_pose`. A fit that is not to be trusted is not published: no tf, and diagnostics say why.
/// Of clouds that come while one is registered the newest is taken. Callbacks must come one at a time.
class RoomPoseNode {
 public:
  /// Throws InputError for unknown or unusable parameters and an unusable scene.
  RoomPoseNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh);
  static NodeDescription description();

 private:
  struct Settings {
    explicit Settings(StrictParameters& parameters);

    std::string scene_file, map_frame, camera_frame, odom_frame;
    bool publish_tf;
    double camera_height_m, lost_after_s, silence_s;
    std::optional<Eigen::Isometry3d> initial_pose;
    RegistrationOptions registration;
  };

  void onCloud(const sensor_msgs::PointCloud2::ConstPtr& cloud);
  void onImu(const sensor_msgs::Imu::ConstPtr& imu);
  void onInitialPose(const geometry_msgs::PoseWithCovarianceStamped::ConstPtr& pose);
  void refuse(const std::string& why);
  void publish(const Registration& fit, const ros::Time& stamp);
  /// The transform that says where the camera is without taking a frame from its parent in tf. Throws InputError, in
  /// words, where there is none.
  geometry_msgs::TransformStamped transformFor(const Eigen::Isometry3d& T_map_camera, const ros::Time& stamp) const;
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const;

  const Settings settings_;
  std::optional<Scene> scene_;
  std::optional<RoomRegistration> registration_;
  GravityEstimate gravity_;

  std::optional<Eigen::Isometry3d> person_, last_;  ///< guess of a person; last trusted pose
  ros::Time trusted_at_;
  ros::WallTime cloud_at_;
  std::string problem_;
  std::optional<Registration> fit_;
  bool upright_ = false;  ///< gravity is known
  std::uint64_t published_ = 0, refused_ = 0;
  double register_ms_ = 0;

  tf2_ros::Buffer tf_buffer_;
  std::optional<TransformReader> tf_reader_;
  tf2_ros::TransformBroadcaster tf_broadcaster_;
  ros::Publisher pose_publisher_;
  ros::Subscriber cloud_subscriber_, imu_subscriber_, initial_subscriber_;
  ros::WallTimer diagnostics_timer_;
  std::unique_ptr<diagnostic_updater::Updater> updater_;
};

}  // namespace mmradartwin
