#include "mmradartwin_sim/ros/room_pose_node.h"

#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/strict_parameters.h"
#include "mmradartwin_dsp/ros/tf_warning_count.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin {
namespace {

constexpr double kWarnEvery_s = 5;
// Materials do not matter here; a scene is loaded for a frequency that its materials hold for.
constexpr double kFrequency_hz = 77.93e9;

std::vector<Eigen::Vector3d> readPoints(const sensor_msgs::PointCloud2& cloud, const Eigen::Isometry3d& T) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(static_cast<std::size_t>(cloud.width) * cloud.height);
  sensor_msgs::PointCloud2ConstIterator<float> x(cloud, "x"), y(cloud, "y"), z(cloud, "z");
  for (; x != x.end(); ++x, ++y, ++z) {
    const Eigen::Vector3d p(*x, *y, *z);
    if (p.allFinite()) points.push_back(T * p);
  }
  return points;
}

}  // namespace

RoomPoseNode::RoomPoseNode(ros::NodeHandle nh, ros::NodeHandle private_nh) {
  readParameters(private_nh);
  scene_.emplace(loadScene(resolvePath(scene_file_, "/"), kFrequency_hz));
  registration_.emplace(*scene_, options_);
  countTfWarningsOfProcess();
  tf_listener_.emplace(tf_buffer_, nh);
  pose_publisher_ = nh.advertise<geometry_msgs::PoseWithCovarianceStamped>("room_pose", 10);
  updater_ = std::make_unique<diagnostic_updater::Updater>(nh, private_nh);
  updater_->setHardwareID("none");
  updater_->add("pose from the room", [this](diagnostic_updater::DiagnosticStatusWrapper& s) { diagnose(s); });
  imu_subscriber_ = nh.subscribe("imu", 200, &RoomPoseNode::onImu, this);
  initial_subscriber_ = nh.subscribe("initialpose", 1, &RoomPoseNode::onInitialPose, this);
  cloud_subscriber_ = nh.subscribe("cloud", 1, &RoomPoseNode::onCloud, this);
  diagnostics_timer_ =
      nh.createWallTimer(ros::WallDuration(1), [this](const ros::WallTimerEvent&) { updater_->force_update(); });
  cloud_at_ = ros::WallTime::now();
}

void RoomPoseNode::readParameters(const ros::NodeHandle& private_nh) {
  StrictParameters parameters(private_nh);
  scene_file_ = parameters.text("scene", "");
  map_frame_ = parameters.text("map_frame", map_frame_);
  camera_frame_ = parameters.text("camera_frame", camera_frame_);
  camera_height_m_ = parameters.number("camera_height_m", camera_height_m_, -100, 100);
  lost_after_s_ = parameters.number("lost_after_s", lost_after_s_, 0, 3600);
  silence_s_ = parameters.number("silence_s", silence_s_, 0.1, 3600);
  options_.max_depth_m = parameters.number("max_depth_m", options_.max_depth_m, 1, 20);
  options_.depth_noise_per_m = parameters.number("depth_noise_per_m", options_.depth_noise_per_m, 0, 0.1);
  options_.scene_error_m = parameters.number("scene_error_m", options_.scene_error_m, 0.001, 0.2);
  options_.min_agreement = parameters.number("min_agreement", options_.min_agreement, 0, 1);
  options_.search_m = parameters.number("search_m", options_.search_m, 0.05, 5);
  options_.search_rad = parameters.number("search_deg", options_.search_rad * 180 / M_PI, 1, 90) * M_PI / 180;
  // "x y yaw": a text, so that a launch file can hand it through.
  const std::string initial = parameters.text("initial_pose", "");
  parameters.number("diagnostic_period", 1.0, 0.01, 3600);  // read by diagnostic_updater
  parameters.boolean("diagnostic_updater_use_fqn", false);
  parameters.rejectUnknown();
  if (scene_file_.empty()) {
    throw InputError("parameter " + private_nh.getNamespace() + "/scene: is missing; give the room's scene.yaml");
  }
  if (initial.empty()) return;
  double x = 0, y = 0, yaw_deg = 0;
  int used = 0;
  if (std::sscanf(initial.c_str(), "%lf %lf %lf %n", &x, &y, &yaw_deg, &used) != 3 ||
      used != static_cast<int>(initial.size()) || !std::isfinite(x + y + yaw_deg)) {
    throw InputError("parameter " + private_nh.getNamespace() + "/initial_pose: '" + initial +
                     "' must be x [m], y [m] and yaw [deg] of the camera in map, apart by blanks");
  }
  person_ =
      Eigen::Translation3d(x, y, camera_height_m_) * Eigen::AngleAxisd(yaw_deg * M_PI / 180, Eigen::Vector3d::UnitZ());
}

void RoomPoseNode::onImu(const sensor_msgs::Imu::ConstPtr& imu) {
  if (imu->linear_acceleration_covariance[0] == -1) return;  // sensor_msgs/Imu: not measured
  try {
    const Eigen::Matrix3d R =
        fromMsg(tf_buffer_.lookupTransform(camera_frame_, imu->header.frame_id, ros::Time(0)).transform).linear();
    const auto& a = imu->linear_acceleration;
    const auto& w = imu->angular_velocity;
    gravity_.add(imu->header.stamp.toSec(), R * Eigen::Vector3d(a.x, a.y, a.z), R * Eigen::Vector3d(w.x, w.y, w.z));
  } catch (const tf2::TransformException& error) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "imu left out, the place of its frame is not known: %s", error.what());
  }
}

void RoomPoseNode::onInitialPose(const geometry_msgs::PoseWithCovarianceStamped::ConstPtr& pose) {
  if (pose->header.frame_id != map_frame_) {
    ROS_ERROR("initialpose is in frame '%s', not '%s': set rviz's fixed frame to it", pose->header.frame_id.c_str(),
              map_frame_.c_str());
    return;
  }
  const auto& p = pose->pose.pose.position;
  const auto& q = pose->pose.pose.orientation;
  const Eigen::Vector3d forward = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized() * Eigen::Vector3d::UnitX();
  // An arrow in rviz lies on the floor; the camera does not.
  person_ = Eigen::Translation3d(p.x, p.y, camera_height_m_) *
            Eigen::AngleAxisd(std::atan2(forward.y(), forward.x()), Eigen::Vector3d::UnitZ());
  last_.reset();
  problem_ = "waiting for a cloud";
}

void RoomPoseNode::refuse(const std::string& why) {
  ++refused_;
  problem_ = why;
  ROS_WARN_THROTTLE(kWarnEvery_s, "no pose published: %s", why.c_str());
}

void RoomPoseNode::onCloud(const sensor_msgs::PointCloud2::ConstPtr& cloud) {
  cloud_at_ = ros::WallTime::now();
  const ros::Time stamp = cloud->header.stamp;
  if (last_ && (stamp < trusted_at_ || (stamp - trusted_at_).toSec() > lost_after_s_)) {
    person_ = last_;  // looked for in a wider circle
    last_.reset();
  }
  if (!last_ && !person_) {
    fit_.reset();
    return refuse(
        "nobody has said yet where the camera is; give a 2D Pose Estimate in rviz, or the parameter initial_pose");
  }
  Eigen::Isometry3d T_camera_cloud;
  try {
    T_camera_cloud = fromMsg(tf_buffer_.lookupTransform(camera_frame_, cloud->header.frame_id, ros::Time(0)).transform);
  } catch (const tf2::TransformException& error) {
    return refuse("tf does not know " + camera_frame_ + " -> " + cloud->header.frame_id +
                  ", which the camera's driver should publish: " + error.what());
  }
  std::vector<Eigen::Vector3d> points;
  try {
    points = readPoints(*cloud, T_camera_cloud);
  } catch (const std::runtime_error& error) {
    return refuse(std::string("the cloud has no x, y and z: ") + error.what());
  }
  const ros::WallTime begin = ros::WallTime::now();
  const std::optional<Eigen::Vector3d> up = gravity_.up(stamp.toSec());
  upright_ = up.has_value();
  fit_ =
      registration_->locate(points, last_ ? *last_ : *person_, last_ ? GuessKind::kTracking : GuessKind::kPerson, up);
  register_ms_ = (ros::WallTime::now() - begin).toSec() * 1e3;
  if (!fit_->trusted) return refuse(fit_->reason);
  publish(*fit_, stamp);
}

void RoomPoseNode::publish(const Registration& fit, const ros::Time& stamp) {
  ++published_;
  problem_.clear();
  last_ = fit.T_map_camera;
  trusted_at_ = stamp;
  geometry_msgs::TransformStamped T = tf2::eigenToTransform(fit.T_map_camera);
  T.header.stamp = stamp;
  T.header.frame_id = map_frame_;
  T.child_frame_id = camera_frame_;
  tf_broadcaster_.sendTransform(T);
  geometry_msgs::PoseWithCovarianceStamped pose;
  pose.header = T.header;
  pose.pose.pose.position = tf2::toMsg(Eigen::Vector3d(fit.T_map_camera.translation()));
  pose.pose.pose.orientation = T.transform.rotation;
  for (int i = 0; i < 36; ++i) pose.pose.covariance[static_cast<std::size_t>(i)] = fit.covariance(i / 6, i % 6);
  pose_publisher_.publish(pose);
}

void RoomPoseNode::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const {
  using Level = diagnostic_msgs::DiagnosticStatus;
  const double silent_s = (ros::WallTime::now() - cloud_at_).toSec();
  if (silent_s > silence_s_) {
    status.summaryf(Level::ERROR, "no cloud on %s for %.0f s; does the camera's driver run?",
                    cloud_subscriber_.getTopic().c_str(), silent_s);
  } else if (!problem_.empty()) {
    status.summary(Level::ERROR, problem_);
  } else if (published_ == 0) {
    status.summary(Level::WARN, "waiting for a cloud");
  } else if (!upright_) {
    status.summary(Level::WARN, "publishing, but without gravity: no imu, or it is being moved");
  } else {
    status.summary(Level::OK, "publishing");
  }
  status.add("poses published", published_);
  status.add("clouds refused", refused_);
  status.add("last registration [ms]", register_ms_);
  if (!fit_) return;
  status.add("distance from the scene's surfaces, rms [m]", fit_->rms_m);
  status.add("share of the cloud at the scene's surfaces", fit_->agreement);
  status.add("share of the cloud behind them", fit_->behind);
  status.add("share of the cloud before them", fit_->before);
  status.add("information of the weakest direction", fit_->information);
  status.add("standard deviation of place [m]",
             std::sqrt(std::max(0.0, fit_->covariance.diagonal().head<3>().maxCoeff())));
  status.add("standard deviation of turn [deg]",
             std::sqrt(std::max(0.0, fit_->covariance.diagonal().tail<3>().maxCoeff())) * 180 / M_PI);
}

}  // namespace mmradartwin
