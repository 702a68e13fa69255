#pragma once

#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include "depth_camera.h"

namespace mmradartwin {

/// Of the sensors: 1 cm before and 2 cm beside camera_link, x right, y down, z forward.
constexpr const char* kOpticalFrame = "camera_depth_optical_frame";

/// The cloud of a DepthCamera as its driver publishes it, without a stamp.
inline sensor_msgs::PointCloud2 cloudMessage(const RayCaster& rays, const Scene& scene,
                                             const Eigen::Isometry3d& T_map_camera, std::mt19937& random) {
  const auto points = DepthCamera().cloud(rays, scene, T_map_camera, random);
  sensor_msgs::PointCloud2 msg;
  msg.header.frame_id = kOpticalFrame;
  sensor_msgs::PointCloud2Modifier modifier(msg);
  modifier.setPointCloud2FieldsByString(1, "xyz");
  modifier.resize(points.size());
  sensor_msgs::PointCloud2Iterator<float> x(msg, "x"), y(msg, "y"), z(msg, "z");
  for (const Eigen::Vector3d& p : points) {
    *x = static_cast<float>(-(p.y() - 0.02)), *y = static_cast<float>(-p.z()), *z = static_cast<float>(p.x() - 0.01);
    ++x, ++y, ++z;
  }
  return msg;
}

/// What the camera's accelerometer says while it rests, without a stamp.
inline sensor_msgs::Imu restingImu(const Eigen::Isometry3d& T_map_camera) {
  sensor_msgs::Imu imu;
  imu.header.frame_id = kOpticalFrame;
  const Eigen::Vector3d up = T_map_camera.linear().transpose() * Eigen::Vector3d(0, 0, 9.81);
  imu.linear_acceleration.x = -up.y(), imu.linear_acceleration.y = -up.z(), imu.linear_acceleration.z = up.x();
  return imu;
}

}  // namespace mmradartwin
