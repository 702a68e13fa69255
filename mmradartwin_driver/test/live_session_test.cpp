// A session that is played: driver and session player over loopback UDP, cubes and tf as a subscriber sees them.
#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>
#include <mmradartwin_msgs/AdcCube.h>
#include <mmradartwin_msgs/RadarConfig.h>
#include <mmradartwin_msgs/Session.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <cmath>
#include <sstream>

#include "emulated_rig.h"

namespace mmradartwin {
namespace {

/// T_map_radar of poses.csv, as the message of the player has it, and the pose's stamp.
struct Row {
  std::string name;
  ros::Time stamp;
  double x;
};

std::vector<Row> rowsOf(const mmradartwin_msgs::Session& session) {
  std::vector<Row> rows;
  for (const auto& file : session.files) {
    if (file.name != "poses.csv") continue;
    std::istringstream in(std::string(file.data.begin(), file.data.end()));
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) {
      std::istringstream fields(line);
      std::vector<std::string> row;
      for (std::string field; std::getline(fields, field, ',');) row.push_back(field);
      const std::size_t point = row[2].find('.');
      std::string fraction = point == std::string::npos ? "" : row[2].substr(point + 1);
      fraction.resize(9, '0');
      rows.push_back(
          {row[0],
           ros::Time(static_cast<std::uint32_t>(std::stoul(row[2])), static_cast<std::uint32_t>(std::stoul(fraction))),
           std::stod(row[3])});
    }
  }
  return rows;
}

TEST(LiveSession, CubesAndPosesMeetAtTheirStamps) {
  const std::vector<int> frames = {6, 4, 5};
  TestFolder folder;
  writeSession(folder, 0.05, frames);
  ros::NodeHandle nh;
  std::vector<mmradartwin_msgs::AdcCube> cubes;
  mmradartwin_msgs::Session::ConstPtr session;
  mmradartwin_msgs::RadarConfig::ConstPtr config;
  bool streamed = false;
  const ros::Subscriber cube_subscriber = nh.subscribe<mmradartwin_msgs::AdcCube>(
      "radar/adc", 100, [&](const mmradartwin_msgs::AdcCube::ConstPtr& cube) { cubes.push_back(*cube); });
  const ros::Subscriber session_subscriber = nh.subscribe<mmradartwin_msgs::Session>(
      "session", 1, [&](const mmradartwin_msgs::Session::ConstPtr& message) { session = message; });
  const ros::Subscriber config_subscriber = nh.subscribe<mmradartwin_msgs::RadarConfig>(
      "radar/config", 1, [&](const mmradartwin_msgs::RadarConfig::ConstPtr& message) { config = message; });
  const ros::Subscriber diagnostics_subscriber = nh.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 10, [&](const diagnostic_msgs::DiagnosticArray::ConstPtr& message) {
        for (const auto& status : message->status) {
          if (status.name.find("radar stream") != std::string::npos && status.message == "streaming") streamed = true;
        }
      });
  tf2_ros::Buffer buffer;
  const tf2_ros::TransformListener listener(buffer);
  const ros::WallTime start_until = ros::WallTime::now() + ros::WallDuration(120);
  while (ros::ok() && !(config && cube_subscriber.getNumPublishers() > 0) && ros::WallTime::now() < start_until) {
    ros::WallDuration(0.05).sleep();
    ros::spinOnce();
  }
  ASSERT_TRUE(config) << "the driver does not start";

  std::string host_ip, card_ip;
  ASSERT_TRUE(ros::param::get("~host_ip", host_ip));
  ASSERT_TRUE(ros::param::get("~card_ip", card_ip));
  ChildProcess player(MMRADARTWIN_PLAYER,
                      {"__name:=session_player", "_session:=" + folder.file(""), "_host_ip:=" + host_ip,
                       "_card_ip:=" + card_ip, "_camera_frame:=camera_link", "_exit_when_done:=true"});
  const ros::WallTime until = ros::WallTime::now() + ros::WallDuration(120);
  double own_late_s = 0;  // what this machine made the worst packet late, as the emulated card tells at the end
  const auto listen = [&](int timeout_ms) {
    const auto line = player.readLine(timeout_ms);
    if (line && line->find("own_late_us=") != std::string::npos) {
      own_late_s = 1e-9 * static_cast<double>(EmulatorProcess::ownLate_ns(*line));
    }
    return line.has_value();
  };
  while (ros::ok() && !player.exitStatus() && ros::WallTime::now() < until) {
    ros::spinOnce();
    listen(5);
  }
  while (listen(0)) {
  }
  ASSERT_TRUE(player.exitStatus());
  EXPECT_EQ(0, *player.exitStatus());
  const ros::WallTime arrived_until = ros::WallTime::now() + ros::WallDuration(60);
  while (ros::ok() && !(cubes.size() >= 15 && session && streamed) && ros::WallTime::now() < arrived_until) {
    ros::WallDuration(0.05).sleep();
    ros::spinOnce();
  }

  ASSERT_TRUE(session);
  ASSERT_TRUE(config);
  EXPECT_TRUE(streamed);
  const std::vector<Row> rows = rowsOf(*session);
  ASSERT_EQ(3u, rows.size());
  ASSERT_EQ(3u, session->capture_sha256.size());
  ASSERT_EQ(15u, cubes.size());
  constexpr double kStay_s = 0.0125;  // of the pose before and after its frames
  std::size_t number = 0;
  for (std::size_t pose = 0; pose < frames.size(); ++pose) {
    const auto bytes = readBytes(folder.file("captures/" + rows[pose].name + ".bin"));
    for (int i = 0; i < frames[pose]; ++i, ++number) {
      SCOPED_TRACE("pose " + rows[pose].name + " frame " + std::to_string(i));
      const auto& cube = cubes[number];
      EXPECT_EQ(number, cube.sequence);
      EXPECT_EQ("radar_link", cube.header.frame_id);
      EXPECT_EQ(0u, cube.lost_bytes);
      ASSERT_EQ(1024u, cube.samples.size());
      // Four lanes: per sample I of rx0..rx3, then Q.
      for (std::size_t word = 0; word < 1024; ++word) {
        const std::size_t at = i * 2048u + word / 8 * 16 + word % 2 * 8 + word / 2 % 4 * 2;
        ASSERT_EQ(static_cast<std::int16_t>(bytes[at] | bytes[at + 1] << 8), cube.samples[word]);
      }
      const double late_s = (cube.header.stamp - rows[pose].stamp).toSec() - 0.05 * i;
      EXPECT_GE(late_s, 0);
      EXPECT_LT(late_s, kStay_s + own_late_s);
      if (late_s >= kStay_s) continue;

      // writeSession turns the radar by q = (0, 0, 0.6, 0.8).
      const auto T = buffer.lookupTransform("map", "radar_link", cube.header.stamp).transform;
      EXPECT_NEAR(rows[pose].x, T.translation.x, 1e-9);
      EXPECT_NEAR(0.5, T.translation.y, 1e-9);
      EXPECT_NEAR(1.2, T.translation.z, 1e-9);
      EXPECT_NEAR(1.0, std::abs(0.6 * T.rotation.z + 0.8 * T.rotation.w), 1e-9);
    }
  }
  EXPECT_NEAR(0.30, (rows[1].stamp - rows[0].stamp).toSec(), 1e-9);  // back to back: 6 frames
}

}  // namespace
}  // namespace mmradartwin

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "live_session_test");
  return RUN_ALL_TESTS();
}
