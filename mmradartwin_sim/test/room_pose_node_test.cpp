// room_pose on the shipped office: a cloud gives tf, covariance and a quiet diagnostic; a cloud that cannot be trusted
// gives no tf and an error that says why.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include "depth_camera_messages.h"

namespace mmradartwin {
namespace {

constexpr double kPatience_s = 60;  // a loaded machine is slow, not wrong

class RoomPoseNodeTest : public ::testing::Test {
 protected:
  RoomPoseNodeTest()
      : scene(loadScene(std::string(MMRADARTWIN_CONFIG) + "/office/scene.yaml", 77.93e9)), rays(scene), listener(tf) {
    cloud_out = nh.advertise<sensor_msgs::PointCloud2>("cloud", 1);
    imu_out = nh.advertise<sensor_msgs::Imu>("imu", 100);
    initial_out = nh.advertise<geometry_msgs::PoseWithCovarianceStamped>("initialpose", 1);
    pose_in = nh.subscribe<geometry_msgs::PoseWithCovarianceStamped>(
        "room_pose", 10, [this](const geometry_msgs::PoseWithCovarianceStamped::ConstPtr& p) { pose = p; });
    diagnostics_in = nh.subscribe<diagnostic_msgs::DiagnosticArray>(
        "/diagnostics", 10, [this](const diagnostic_msgs::DiagnosticArray::ConstPtr& a) {
          for (const auto& s : a->status) {
            if (s.name.find("pose from the room") != std::string::npos) status = s;
          }
        });
    truth = Eigen::Translation3d(6.0, 1.5, 1.25) * Eigen::AngleAxisd(1.6, Eigen::Vector3d::UnitZ()) *
            Eigen::AngleAxisd(0.08, Eigen::Vector3d::UnitY());
  }

  bool waitFor(const std::function<bool()>& done, const std::function<void()>& meanwhile = {}) {
    const ros::WallTime begin = ros::WallTime::now();
    while (ros::ok() && (ros::WallTime::now() - begin).toSec() < kPatience_s) {
      ros::spinOnce();
      if (done()) return true;
      if (meanwhile) meanwhile();
      ros::WallDuration(0.05).sleep();
    }
    return false;
  }

  sensor_msgs::PointCloud2 message(const Eigen::Isometry3d& T_map_camera) {
    return cloudMessage(rays, scene, T_map_camera, random);
  }
  void send(sensor_msgs::PointCloud2& msg) {
    sensor_msgs::Imu imu = restingImu(truth);
    imu.header.stamp = ros::Time::now();
    for (int i = 0; i < 3; ++i) imu_out.publish(imu);
    msg.header.stamp = ros::Time::now();
    cloud_out.publish(msg);
  }
  void sendGuess(double x, double y, double yaw) {
    geometry_msgs::PoseWithCovarianceStamped guess;
    guess.header.frame_id = "map";
    guess.pose.pose.position.x = x, guess.pose.pose.position.y = y;
    guess.pose.pose.orientation.z = std::sin(yaw / 2), guess.pose.pose.orientation.w = std::cos(yaw / 2);
    initial_out.publish(guess);
  }

  ros::NodeHandle nh;
  Scene scene;
  RayCaster rays;
  tf2_ros::Buffer tf;
  tf2_ros::TransformListener listener;
  ros::Publisher cloud_out, imu_out, initial_out;
  ros::Subscriber pose_in, diagnostics_in;
  geometry_msgs::PoseWithCovarianceStamped::ConstPtr pose;
  diagnostic_msgs::DiagnosticStatus status;
  Eigen::Isometry3d truth;
  std::mt19937 random{1};
};

TEST_F(RoomPoseNodeTest, PublishesWhatIsTrustedAndRefusesTheRest) {
  using Level = diagnostic_msgs::DiagnosticStatus;
  ASSERT_TRUE(waitFor([this] {
    return cloud_out.getNumSubscribers() > 0 && imu_out.getNumSubscribers() > 0 &&
           initial_out.getNumSubscribers() > 0 && pose_in.getNumPublishers() > 0;
  })) << "room_pose did not come up";
  sensor_msgs::PointCloud2 seen = message(truth);

  // Nobody has said where the camera is.
  ASSERT_TRUE(
      waitFor([this] { return status.message.find("2D Pose Estimate") != std::string::npos; }, [&] { send(seen); }));
  EXPECT_EQ(status.level, Level::ERROR);
  EXPECT_FALSE(tf.canTransform("map", "camera_link", ros::Time(0)));

  // A cloud of a flat wall right ahead fixes nothing.
  sensor_msgs::PointCloud2 wall = seen;
  {
    sensor_msgs::PointCloud2Iterator<float> x(wall, "x"), y(wall, "y"), z(wall, "z");
    for (; x != x.end(); ++x, ++y, ++z) {
      *x /= *z, *y /= *z, *z = 1;
    }
  }
  sendGuess(truth.translation().x() + 0.2, truth.translation().y() - 0.2, 1.7);
  status = {};
  ASSERT_TRUE(waitFor(
      [this] {
        return status.level == Level::ERROR && status.message.find("waiting") == std::string::npos &&
               status.message.find("nobody") == std::string::npos;
      },
      [&] { send(wall); }));
  EXPECT_FALSE(status.message.empty());
  EXPECT_FALSE(tf.canTransform("map", "camera_link", ros::Time(0))) << status.message;
  EXPECT_FALSE(pose);

  // The true cloud does.
  ASSERT_TRUE(
      waitFor([this] { return pose && tf.canTransform("map", "camera_link", ros::Time(0)); }, [&] { send(seen); }))
      << status.message;
  const auto T = tf.lookupTransform("map", "camera_link", ros::Time(0)).transform;
  const Eigen::Vector3d p(T.translation.x, T.translation.y, T.translation.z);
  const Eigen::Quaterniond q(T.rotation.w, T.rotation.x, T.rotation.y, T.rotation.z);
  EXPECT_LT((p - truth.translation()).norm(), 0.03);
  EXPECT_LT(q.angularDistance(Eigen::Quaterniond(truth.linear())), 0.01);
  EXPECT_GT(pose->pose.covariance[0], 0);
  EXPECT_LT(pose->pose.covariance[0], 4e-4);
  EXPECT_GT(pose->pose.covariance[35], 0);
  status = {};
  status.level = Level::STALE;
  EXPECT_TRUE(waitFor([this] { return status.level == Level::OK; }, [&] { send(seen); })) << status.message;

  // Silence is an error.
  EXPECT_TRUE(waitFor([this] { return status.level == Level::ERROR && status.message.find("no cloud") == 0; }));
}

}  // namespace
}  // namespace mmradartwin

int main(int argc, char** argv) {
  ros::init(argc, argv, "test_room_pose_node");
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
