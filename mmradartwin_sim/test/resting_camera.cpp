// A depth camera that rests at a place in a scene, with its driver: publishes cloud, imu and the frame of its sensors.
// usage: resting_camera SCENE X Y Z YAW PITCH [NAME:=VALUE...]      metres and radians in map
#include <geometry_msgs/TransformStamped.h>
#include <ros/ros.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <cstdlib>
#include <iostream>

#include "depth_camera_messages.h"

int main(int argc, char** argv) {
  using namespace mmradartwin;
  ros::init(argc, argv, "resting_camera");
  if (argc != 7) {
    std::cerr << "usage: resting_camera SCENE X Y Z YAW PITCH [NAME:=VALUE...]\n";
    return 2;
  }
  const auto number = [argv](int i) { return std::atof(argv[i]); };
  const Scene scene = loadScene(argv[1], 77.93e9);
  const RayCaster rays(scene);
  const Eigen::Isometry3d T_map_camera = Eigen::Translation3d(number(2), number(3), number(4)) *
                                         Eigen::AngleAxisd(number(5), Eigen::Vector3d::UnitZ()) *
                                         Eigen::AngleAxisd(number(6), Eigen::Vector3d::UnitY());
  ros::NodeHandle nh;
  geometry_msgs::TransformStamped T;
  T.header.stamp = ros::Time::now();
  T.header.frame_id = "camera_link";
  T.child_frame_id = kOpticalFrame;
  T.transform.translation.x = 0.01;
  T.transform.translation.y = 0.02;
  const Eigen::Quaterniond q(Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitX()));
  T.transform.rotation.x = q.x(), T.transform.rotation.y = q.y();
  T.transform.rotation.z = q.z(), T.transform.rotation.w = q.w();
  tf2_ros::StaticTransformBroadcaster frames;
  frames.sendTransform(T);

  ros::Publisher cloud_out = nh.advertise<sensor_msgs::PointCloud2>("cloud", 1);
  ros::Publisher imu_out = nh.advertise<sensor_msgs::Imu>("imu", 100);
  std::mt19937 random(1);
  sensor_msgs::Imu imu = restingImu(T_map_camera);
  for (int i = 0; ros::ok(); ++i) {
    ros::spinOnce();
    imu.header.stamp = ros::Time::now();
    imu_out.publish(imu);
    if (i % 15 == 0) {  // its noise is another one in every cloud
      const ros::Time exposed = ros::Time::now();
      sensor_msgs::PointCloud2 cloud = cloudMessage(rays, scene, T_map_camera, random);
      cloud.header.stamp = exposed;
      cloud_out.publish(cloud);
    }
    ros::WallDuration(0.02).sleep();
  }
  return 0;
}
