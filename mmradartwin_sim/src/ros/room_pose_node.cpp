#include "mmradartwin_sim/ros/room_pose_node.h"

#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/tf_warning_count.h"

namespace mmradartwin {
namespace {

constexpr double kWarnOfPoseEvery_s = 5;
// Materials do not matter here; a scene is loaded for a frequency that its materials hold for.
constexpr double kFrequency_hz = 77.93e9;

/// Whether a cloud's fields and sizes are true of its data, which the iterators below rely on.
bool consistent(const sensor_msgs::PointCloud2& cloud) {
  const std::uint64_t points = std::uint64_t{cloud.width} * cloud.height;
  if (cloud.point_step == 0 || points > cloud.data.size() / cloud.point_step) return false;
  return std::all_of(cloud.fields.begin(), cloud.fields.end(), [&](const sensor_msgs::PointField& field) {
    const bool coordinate = field.name == "x" || field.name == "y" || field.name == "z";
    return !coordinate || (field.datatype == sensor_msgs::PointField::FLOAT32 &&
                           std::uint64_t{field.offset} + sizeof(float) <= cloud.point_step);
  });
}

std::vector<Eigen::Vector3d> readPoints(const sensor_msgs::PointCloud2& cloud, const Eigen::Isometry3d& T) {
  if (!consistent(cloud)) throw std::runtime_error("its sizes or fields are not those of its data");
  if (cloud.data.empty()) return {};
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

RoomPoseNode::RoomPoseNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh)
    : settings_(readSettings<Settings>(private_nh)) {
  person_ = settings_.initial_pose;
  scene_.emplace(loadScene(settings_.scene_file, kFrequency_hz));
  registration_.emplace(*scene_, settings_.registration);
  countTfWarningsOfProcess();
  tf_reader_.emplace(tf_buffer_);
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

RoomPoseNode::Settings::Settings(StrictParameters& parameters) {
  scene_file = parameters.requiredPath("scene", "scene.yaml of the room");
  map_frame = parameters.text("map_frame", "map", "tf frame of the scene");
  camera_frame = parameters.text("camera_frame", "camera_link", "tf frame of the camera");
  odom_frame = parameters.text("odom_frame", "",
                               "of a robot whose tf has this frame to the camera: its place in map_frame is published "
                               "instead of the camera's; empty: the camera has no other parent");
  publish_tf = parameters.boolean("publish_tf", true, "false: the pose comes on the topic room_pose alone");
  camera_height_m =
      parameters.number("camera_height_m", 1.2, -100, 100, "height of the camera over map's floor, for a first fix, m");
  lost_after_s = parameters.number("lost_after_s", 2, 0, 3600,
                                   "after so long without a trusted pose it is looked for in a wider circle, s");
  silence_s = parameters.number("silence_s", 2, 0.1, 3600, "without a cloud for so long diagnostics say so, s");
  RegistrationOptions& r = registration;
  r.max_depth_m = parameters.number("max_depth_m", r.max_depth_m, 1, 20, "points beyond are left out, m");
  r.depth_noise_per_m = parameters.number("depth_noise_per_m", r.depth_noise_per_m, 0, 0.1,
                                          "standard deviation of a depth, by depth squared, 1/m");
  r.scene_error_m =
      parameters.number("scene_error_m", r.scene_error_m, 0.001, 0.2, "standard deviation of the scene's surfaces, m");
  r.min_agreement = parameters.number("min_agreement", r.min_agreement, 0, 1,
                                      "least share of the cloud at the scene's surfaces for a trusted pose");
  r.search_m = parameters.number("search_m", r.search_m, 0.05, 5, "how far from a person's guess is looked, m");
  r.search_rad = parameters.number("search_deg", r.search_rad * 180 / M_PI, 1, 90,
                                   "how far from a person's guess is looked, deg") *
                 M_PI / 180;
  // "x y yaw": a text, so that a launch file can hand it through.
  const std::string initial = parameters.text(
      "initial_pose", "", "x [m] y [m] yaw [deg] of the camera in map; empty: wait for a 2D Pose Estimate");
  parameters.ofDiagnosticUpdater();
  if (initial.empty()) return;
  double x = 0, y = 0, yaw_deg = 0;
  int used = 0;
  if (std::sscanf(initial.c_str(), "%lf %lf %lf %n", &x, &y, &yaw_deg, &used) != 3 ||
      used != static_cast<int>(initial.size()) || !std::isfinite(x + y + yaw_deg)) {
    throw InputError("parameter initial_pose: '" + initial +
                     "' must be x [m], y [m] and yaw [deg] of the camera in map, apart by blanks");
  }
  initial_pose =
      Eigen::Translation3d(x, y, camera_height_m) * Eigen::AngleAxisd(yaw_deg * M_PI / 180, Eigen::Vector3d::UnitZ());
}

NodeDescription RoomPoseNode::description() {
  return {"room_pose",
          "room_pose",
          "Finds where the camera is in the room, by its cloud and the scene, and says it in tf.",
          {topic<sensor_msgs::PointCloud2>("cloud", "the camera's points"),
           topic<sensor_msgs::Imu>("imu", "the camera's accelerations and turns, for gravity"),
           topic<geometry_msgs::PoseWithCovarianceStamped>("initialpose", "rviz's 2D Pose Estimate: about where it is"),
           topic<tf2_msgs::TFMessage>("/tf", "frames of the camera's sensors"),
           topic<tf2_msgs::TFMessage>("/tf_static", "the same of what does not move")},
          {topic<tf2_msgs::TFMessage>("/tf", "pose of the camera, or of odom_frame, while it is trusted"),
           topic<geometry_msgs::PoseWithCovarianceStamped>("room_pose", "the same pose with its covariance"),
           topic<diagnostic_msgs::DiagnosticArray>("/diagnostics", "whether a pose is found, and why not")},
          {},
          [](StrictParameters& parameters) { const Settings settings(parameters); }};
}

void RoomPoseNode::onImu(const sensor_msgs::Imu::ConstPtr& imu) {
  if (imu->linear_acceleration_covariance[0] == -1) return;  // sensor_msgs/Imu: not measured
  if (!usableStamp(imu->header.stamp)) {
    ROS_WARN_THROTTLE(kWarnOfPoseEvery_s, "imu left out: its stamp, %u s, is no time", imu->header.stamp.sec);
    return;
  }
  try {
    const Eigen::Matrix3d R =
        fromMsg(tf_buffer_.lookupTransform(settings_.camera_frame, imu->header.frame_id, ros::Time(0)).transform)
            .linear();
    const auto& a = imu->linear_acceleration;
    const auto& w = imu->angular_velocity;
    gravity_.add(imu->header.stamp.toSec(), R * Eigen::Vector3d(a.x, a.y, a.z), R * Eigen::Vector3d(w.x, w.y, w.z));
  } catch (const std::exception& error) {
    ROS_WARN_THROTTLE(kWarnOfPoseEvery_s, "imu left out, the place of its frame is not known: %s", error.what());
  }
}

void RoomPoseNode::onInitialPose(const geometry_msgs::PoseWithCovarianceStamped::ConstPtr& pose) {
  if (pose->header.frame_id != settings_.map_frame) {
    ROS_ERROR("initialpose is in frame '%s', not '%s': set rviz's fixed frame to it", pose->header.frame_id.c_str(),
              settings_.map_frame.c_str());
    return;
  }
  const auto& p = pose->pose.pose.position;
  const auto& q = pose->pose.pose.orientation;
  const Eigen::Vector3d forward = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized() * Eigen::Vector3d::UnitX();
  // An arrow in rviz lies on the floor; the camera does not.
  person_ = Eigen::Translation3d(p.x, p.y, settings_.camera_height_m) *
            Eigen::AngleAxisd(std::atan2(forward.y(), forward.x()), Eigen::Vector3d::UnitZ());
  last_.reset();
  problem_ = "waiting for a cloud";
}

void RoomPoseNode::refuse(const std::string& why) {
  ++refused_;
  problem_ = why;
  ROS_WARN_THROTTLE(kWarnOfPoseEvery_s, "no pose published: %s", why.c_str());
}

void RoomPoseNode::onCloud(const sensor_msgs::PointCloud2::ConstPtr& cloud) {
  cloud_at_ = ros::WallTime::now();
  const ros::Time stamp = cloud->header.stamp;
  if (!usableStamp(stamp)) return refuse("the cloud's stamp, " + std::to_string(stamp.sec) + " s, is no time");
  tf_reader_->measuredAt(stamp);
  if (last_ && (stamp < trusted_at_ || (stamp - trusted_at_).toSec() > settings_.lost_after_s)) {
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
    T_camera_cloud =
        fromMsg(tf_buffer_.lookupTransform(settings_.camera_frame, cloud->header.frame_id, ros::Time(0)).transform);
  } catch (const tf2::TransformException& error) {
    return refuse("tf does not know " + settings_.camera_frame + " -> " + cloud->header.frame_id +
                  ", which the camera's driver should publish: " + error.what());
  }
  std::vector<Eigen::Vector3d> points;
  try {
    points = readPoints(*cloud, T_camera_cloud);
  } catch (const std::runtime_error& error) {
    return refuse(std::string("the cloud has no usable x, y and z: ") + error.what());
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

geometry_msgs::TransformStamped RoomPoseNode::transformFor(const Eigen::Isometry3d& T_map_camera,
                                                           const ros::Time& stamp) const {
  Eigen::Isometry3d T_map_child = T_map_camera;
  if (settings_.odom_frame.empty()) {
    std::string parent;
    if (tf_buffer_._getParent(settings_.camera_frame, ros::Time(0), parent) && parent != settings_.map_frame) {
      throw InputError(settings_.camera_frame + " has the parent " + parent +
                       " in tf already: give odom_frame, the robot's frame below " + settings_.map_frame +
                       ", or publish_tf: false");
    }
  } else {
    try {
      T_map_child =
          T_map_camera *
          fromMsg(tf_buffer_.lookupTransform(settings_.camera_frame, settings_.odom_frame, stamp, ros::Duration(0.1))
                      .transform);
    } catch (const tf2::TransformException& error) {
      throw InputError("tf does not know " + settings_.odom_frame + " -> " + settings_.camera_frame +
                       " at the cloud's time, which the robot should publish: " + error.what());
    }
  }
  geometry_msgs::TransformStamped T = tf2::eigenToTransform(T_map_child);
  T.header.stamp = stamp;
  T.header.frame_id = settings_.map_frame;
  T.child_frame_id = settings_.odom_frame.empty() ? settings_.camera_frame : settings_.odom_frame;
  return T;
}

void RoomPoseNode::publish(const Registration& fit, const ros::Time& stamp) {
  ++published_;
  problem_.clear();
  last_ = fit.T_map_camera;
  trusted_at_ = stamp;
  if (settings_.publish_tf) {
    try {
      tf_broadcaster_.sendTransform(transformFor(fit.T_map_camera, stamp));
    } catch (const InputError& error) {
      refuse(error.what());
    }
  }
  geometry_msgs::PoseWithCovarianceStamped pose;
  pose.header.stamp = stamp;
  pose.header.frame_id = settings_.map_frame;
  pose.pose.pose = mmradartwin::toMsg(fit.T_map_camera);
  for (int i = 0; i < 36; ++i) pose.pose.covariance[static_cast<std::size_t>(i)] = fit.covariance(i / 6, i % 6);
  pose_publisher_.publish(pose);
}

void RoomPoseNode::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const {
  using Level = diagnostic_msgs::DiagnosticStatus;
  const double silent_s = (ros::WallTime::now() - cloud_at_).toSec();
  if (silent_s > settings_.silence_s) {
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
  status.add("transforms of the future left out", tf_reader_->futureCount());
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
