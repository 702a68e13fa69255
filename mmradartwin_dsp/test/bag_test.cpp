#include "mmradartwin_dsp/ros/bag.h"

#include <gtest/gtest.h>
#include <mmradartwin_msgs/Session.h>
#include <ros/time.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sys/resource.h>
#include <tf2_msgs/TFMessage.h>

#include "mmradartwin_dsp/average_pose.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "test_session_folder.h"

namespace mmradartwin {
namespace {

/// Copies a bag without some topics.
void copyWithout(const std::string& from, const std::string& to, const std::set<std::string>& topics) {
  const rosbag::Bag in(from, rosbag::bagmode::Read);
  rosbag::Bag out(to, rosbag::bagmode::Write);
  rosbag::View view(in);
  for (const rosbag::MessageInstance& message : view) {
    if (!topics.count(message.getTopic()))
      out.write(message.getTopic(), message.getTime(), message, message.getConnectionHeader());
  }
}

void expectSameFrames(const Recording& a, const Recording& b) {
  ASSERT_EQ(a.poses.size(), b.poses.size());
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_EQ(a.poses[i].name, b.poses[i].name);
    EXPECT_EQ(a.poses[i].location, b.poses[i].location);
    EXPECT_EQ(a.poses[i].stamp_ns, b.poses[i].stamp_ns);
    EXPECT_TRUE(a.poses[i].T_map_radar.matrix() == b.poses[i].T_map_radar.matrix());
    const std::vector<AdcCube> one = framesOf(a, a.poses[i]), other = framesOf(b, b.poses[i]);
    ASSERT_EQ(one.size(), other.size()) << a.poses[i].name;
    for (std::size_t f = 0; f < one.size(); ++f) {
      EXPECT_EQ(one[f].stamp_ns, other[f].stamp_ns);
      EXPECT_EQ(one[f].sequence, other[f].sequence);
      EXPECT_EQ(one[f].data, other[f].data);
      EXPECT_EQ(one[f].chirp_valid, other[f].chirp_valid);
    }
  }
}

TEST(Conversions, RadarSurvivesAndHashesItsContent) {
  RadarConfig radar = paperRadar();
  radar.tx_enable = {{0}, {1, 2}};
  radar.rx_enable = {0, 1, 2, 3};
  radar.idle_s = 7e-6;
  mmradartwin_msgs::RadarConfig msg = toMsg(radar);
  EXPECT_EQ(toYaml(fromMsg(msg)), toYaml(radar));
  const std::uint64_t hash = radarHash(msg);
  msg.header.seq = 5;
  msg.header.stamp = ros::Time(7);
  msg.header.frame_id = "other";
  EXPECT_EQ(radarHash(msg), hash);
  msg.slope_hz_per_s = std::nextafter(msg.slope_hz_per_s, 0);
  EXPECT_NE(radarHash(msg), hash);
  msg.layout = "3lane";
  EXPECT_TRUE(saysInOneLine(inputError([&] { fromMsg(msg); }), "layout", "3lane"));
}

TEST(Conversions, ARadarOfVastFramesIsRefused) {
  mmradartwin_msgs::RadarConfig msg = toMsg(paperRadar());
  msg.loops_per_frame = 32768;
  msg.frame_period_s = 2;
  EXPECT_EQ(fromMsg(msg).loops_per_frame, 32768) << "64 MiB";
  msg.samples_per_chirp = 128;
  msg.sample_rate_hz = 1e7;
  EXPECT_TRUE(saysInOneLine(inputError([&] { fromMsg(msg); }), "radar/config", "max_frame_mb", "128 MiB"));
}

TEST(Conversions, HashIsThatOfTheSerialisedMessage) {
  // SHA-256 of the bytes, computed apart from this code (Python: struct and hashlib) for the paper's radar.
  EXPECT_EQ(radarHash(paperRadar()), 0x5fc669d3ee5054a8ull);
}

TEST(Conversions, MalformedMessagesAreInputErrors) {
  AdcCube cube;
  cube.chirps = 2, cube.samples = 4, cube.receivers = 1;
  cube.data.resize(16);
  cube.chirp_valid.resize(2);
  mmradartwin_msgs::AdcCube msg = toMsg(cube, 1);
  EXPECT_EQ(fromMsg(msg).data, cube.data);
  msg.samples.pop_back();
  EXPECT_TRUE(saysInOneLine(inputError([&] { fromMsg(msg); }), "samples", "15", "16"));
  msg.samples_per_chirp = 0xffffffff;
  EXPECT_FALSE(inputError([&] { fromMsg(msg); }).empty());
  ReceiveGrid grid;
  grid.x = ComplexGrid::Constant(2, 3, {1, 2});
  mmradartwin_msgs::ReceiveGrid grid_msg = toMsg(grid, 1);
  EXPECT_TRUE(fromMsg(grid_msg).x == grid.x);
  grid_msg.data[3] = std::nan("");
  EXPECT_TRUE(saysInOneLine(inputError([&] { fromMsg(grid_msg); }), "not finite"));
  grid_msg.data[3] = 0;
  grid_msg.full_scale = 0;
  EXPECT_TRUE(saysInOneLine(inputError([&] { fromMsg(grid_msg); }), "full_scale"));
  grid_msg.full_scale = 1;
  grid_msg.source = 2;
  EXPECT_TRUE(saysInOneLine(inputError([&] { fromMsg(grid_msg); }), "source"));
}

TEST(Bag, SessionComesBackByteForByte) {
  const TestFolder folder;
  // A duplicate, a pose that is NaN, one whose capture is missing and one whose capture is cut: all must survive.
  writeSession(folder / "lab",
               "003,B,1700000010,3,2,1.1,0,0,0,1\n004,B,1700000020,nan,2,1.1,0,0,0,1\n"
               "005,C,1700000030,5,2,1.1,0,0,0,1\n006,C,1700000040,6,2,1.1,0,0,0,1\n");
  const RadarConfig radar = paperRadar();
  writeBytes(folder / "lab/captures/003.bin", randomCapture(radar, 7, 3));
  writeBytes(folder / "lab/captures/004.bin", randomCapture(radar, 2, 4));
  writeBytes(folder / "lab/captures/006.bin", randomCapture(radar, 2, 6).substr(0, 3000));
  int last_done = 0;
  sessionToBag(folder / "lab", folder / "lab.bag", [&](int done, int total) {
    EXPECT_EQ(total, 7);
    EXPECT_EQ(done, ++last_done);
  });
  EXPECT_EQ(last_done, 7);
  EXPECT_FALSE(std::filesystem::exists(folder / "lab.bag.active"));
  bagToSession(folder / "lab.bag", folder / "back");
  EXPECT_EQ(contentsOf(folder / "back"), contentsOf(folder / "lab"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { bagToSession(folder / "lab.bag", folder / "back"); }), "back", "already"));
}

TEST(Bag, SessionAndItsBagAreTheSameRecording) {
  const TestFolder folder;
  writeSession(folder / "lab",
               "003,B,1700000010,3,2,1.1,0,0,0,1\n004,B,1700000020,nan,2,1.1,0,0,0,1\n"
               "005,C,1700000030,5,2,1.1,0,0,0,1\n");
  sessionToBag(folder / "lab", folder / "lab.bag");
  std::filesystem::rename(folder / "lab", folder / "gone");
  Recording bag = openBag(folder / "lab.bag");
  const Recording session = openSession(folder / "gone");
  EXPECT_EQ(bag.name, "lab");
  EXPECT_EQ(bag.duplicates, session.duplicates);
  EXPECT_EQ(bag.problems.size(), 1u);
  EXPECT_TRUE(std::filesystem::exists(*bag.scene_file));
  EXPECT_EQ(toYaml(bag.radar), toYaml(session.radar));
  ASSERT_EQ(bag.poses.size(), 4u);
  EXPECT_TRUE(saysInOneLine(inputError([&] { framesOf(bag, bag.poses[3]); }), "pose '005'", "no frames"));
  bag.poses.pop_back();
  Recording rest = session;
  rest.poses.pop_back();
  expectSameFrames(bag, rest);
  const std::string scene = *bag.scene_file;
  bag = Recording();
  EXPECT_FALSE(std::filesystem::exists(scene)) << "the temporary folder stayed behind";
}

TEST(Bag, LatchedMessagesAreMarkedSoAndTfBracketsEachPose) {
  const TestFolder folder;
  writeSession(folder / "lab");
  sessionToBag(folder / "lab", folder / "lab.bag");
  const rosbag::Bag bag(folder / "lab.bag", rosbag::bagmode::Read);
  rosbag::View view(bag);
  std::vector<std::int64_t> tf;
  int latched = 0, cubes = 0;
  for (const rosbag::MessageInstance& message : view) {
    if (const auto transforms = message.instantiate<tf2_msgs::TFMessage>())
      tf.push_back(toNanoseconds(transforms->transforms[0].header.stamp));
    const auto header = message.getConnectionHeader();
    if (header->count("latching") && header->at("latching") == "1") ++latched;
    if (const auto cube = message.instantiate<mmradartwin_msgs::AdcCube>()) {
      ++cubes;
      EXPECT_EQ(cube->radar_hash, radarHash(paperRadar()));
      EXPECT_EQ(cube->header.frame_id, "radar_link");
    }
  }
  EXPECT_EQ(latched, 2);
  EXPECT_EQ(cubes, 12);
  ASSERT_EQ(tf.size(), 15u);
  EXPECT_EQ(tf[0], 1700000000237500000);  // first frame - 12.5 ms
  EXPECT_EQ(tf[4], 1700000000412500000);  // fourth frame + 12.5 ms
}

/// A live recording: the radar stands, moves, stands; no session message.
void writeLiveBag(const std::string& file, const std::string& ns = "") {
  rosbag::Bag bag(file, rosbag::bagmode::Write);
  const RadarConfig radar = paperRadar();
  const ros::Time start(1700000000);
  mmradartwin_msgs::RadarConfig config = toMsg(radar);
  bag.write(ns + "/radar/config", start, config);
  tf2_msgs::TFMessage mount;
  mount.transforms.resize(1);
  mount.transforms[0].header.frame_id = "camera";
  mount.transforms[0].child_frame_id = "radar_link";
  mount.transforms[0].transform.translation.x = 0.1;
  mount.transforms[0].transform.rotation.w = 1;
  bag.write("/tf_static", start, mount);
  AdcCube cube;
  cube.chirps = 2, cube.samples = 64, cube.receivers = 4;
  cube.data.assign(2 * 64 * 4 * 2, 5);
  cube.chirp_valid.assign(2, 1);
  for (int i = 0; i < 140; ++i) {
    const ros::Time now = start + ros::Duration(i * 0.05);
    const double x = i < 60 ? 0 : i < 80 ? (i - 60) * 0.1 : 2;
    tf2_msgs::TFMessage tf = mount;
    tf.transforms[0].header.stamp = now + ros::Duration(0.001);
    tf.transforms[0].header.frame_id = "map";
    tf.transforms[0].child_frame_id = "camera";
    tf.transforms[0].transform.translation.x = x;
    bag.write("/tf", now + ros::Duration(0.002), tf);
    cube.stamp_ns = toNanoseconds(now);
    cube.sequence = static_cast<std::uint32_t>(i);
    bag.write(ns + "/radar/adc", now + ros::Duration(0.06),
              toMsg(cube, radarHash(radar)));  // a frame arrives a period late
  }
}

TEST(Bag, PosesOfALiveRecordingAreWhereTheRadarStood) {
  const TestFolder folder;
  writeLiveBag(folder / "live.bag");
  const Recording recording = openBag(folder / "live.bag");
  EXPECT_EQ(recording.name, "live");
  ASSERT_EQ(recording.poses.size(), 2u);
  EXPECT_NEAR(recording.poses[0].T_map_radar.translation().x(), 0.1, 1e-9);  // through the static mount
  EXPECT_NEAR(recording.poses[1].T_map_radar.translation().x(), 2.1, 1e-9);
  EXPECT_NEAR(static_cast<double>(framesOf(recording, recording.poses[0]).size()), 60, 1);
  EXPECT_NEAR(static_cast<double>(framesOf(recording, recording.poses[1]).size()), 60, 1);
  for (const AdcCube& cube : framesOf(recording, recording.poses[1])) EXPECT_GE(cube.sequence, 79u);

  bagToSession(folder / "live.bag", folder / "out");
  expectSameFrames(openSession(folder / "out"), [&] {
    Recording from_zero = recording;  // a capture counts its frames from 0, at the period
    from_zero.forEachFrame = [&](const Pose& pose, const std::function<void(const AdcCube&)>& visit) {
      std::uint32_t i = 0;
      recording.forEachFrame(pose, [&](AdcCube cube) {
        cube.sequence = i;
        cube.stamp_ns = pose.stamp_ns + recording.radar.frame_offset_ns(i++);
        visit(cube);
      });
    };
    Recording copy = from_zero;
    for (Pose& pose : copy.poses)
      pose.T_map_radar =
          openSession(folder / "out").poses[static_cast<std::size_t>(&pose - copy.poses.data())].T_map_radar;
    return copy;
  }());
}

TEST(Bag, NamespacesAreFound) {
  const TestFolder folder;
  writeLiveBag(folder / "ns.bag", "/robot1");
  EXPECT_EQ(openBag(folder / "ns.bag").poses.size(), 2u);
  BagOptions options;
  options.ns = "/robot1";
  EXPECT_EQ(openBag(folder / "ns.bag", options).poses.size(), 2u);
  options.ns = "/robot2";
  EXPECT_TRUE(
      saysInOneLine(inputError([&] { openBag(folder / "ns.bag", options); }), "robot2/radar/adc", "/robot1/radar/adc"));
}

TEST(Bag, ASessionPlayedAtAnotherTimeIsRecognisedByPlace) {
  const TestFolder folder;
  writeSession(folder / "lab", "003,C,1700000100,2.1,0,0,0,0,0,1\n");
  writeBytes(folder / "lab/captures/003.bin", randomCapture(paperRadar(), 2, 3));
  sessionToBag(folder / "lab", folder / "lab.bag");
  // The live recording lies at the same stamps by chance; shift it by an hour and add the session message.
  writeLiveBag(folder / "live.bag");
  {
    const rosbag::Bag from(folder / "lab.bag", rosbag::bagmode::Read);
    const rosbag::Bag live(folder / "live.bag", rosbag::bagmode::Read);
    rosbag::Bag out(folder / "both.bag", rosbag::bagmode::Write);
    const ros::Duration hour(-3600 * 24);
    rosbag::View session(from, rosbag::TopicQuery("/session")), rest(live);
    for (const auto& message : session)
      out.write("/session", ros::Time(1), *message.instantiate<mmradartwin_msgs::Session>());
    for (const auto& message : rest) {
      if (auto cube = message.instantiate<mmradartwin_msgs::AdcCube>()) {
        cube->header.stamp += hour;
        out.write(message.getTopic(), message.getTime() + hour, *cube);
      } else if (auto tf = message.instantiate<tf2_msgs::TFMessage>()) {
        if (message.getTopic() == "/tf") tf->transforms[0].header.stamp += hour;
        out.write(message.getTopic(), message.getTime() + hour, *tf);
      } else {
        out.write(message.getTopic(), message.getTime() + hour, message);
      }
    }
  }
  const Recording recording = openBag(folder / "both.bag");
  const auto pose =
      std::find_if(recording.poses.begin(), recording.poses.end(), [](const Pose& p) { return p.name == "003"; });
  ASSERT_NE(pose, recording.poses.end());
  EXPECT_NEAR(static_cast<double>(framesOf(recording, *pose).size()), 60, 1);
  EXPECT_EQ(pose->location, "C");
}

TEST(Bag, WhatIsMissingIsNamed) {
  const TestFolder folder;
  writeSession(folder / "lab");
  sessionToBag(folder / "lab", folder / "lab.bag");
  const auto without = [&](const std::set<std::string>& topics) {
    copyWithout(folder / "lab.bag", folder / "cut.bag", topics);
    return inputError([&] { openBag(folder / "cut.bag"); });
  };
  EXPECT_TRUE(saysInOneLine(without({"/tf"}), "cut.bag", "no tf", "map -> radar_link"));
  EXPECT_TRUE(saysInOneLine(without({"/tf", "/session"}), "cut.bag", "no tf"));
  EXPECT_TRUE(saysInOneLine(without({"/radar/config"}), "cut.bag", "radar/config"));
  EXPECT_TRUE(saysInOneLine(without({"/radar/adc"}), "cut.bag", "no frames", "radar/adc"));
  EXPECT_TRUE(saysInOneLine(without({"/session"}), "cut.bag", "no pose", "1 s"));  // 0.2 s each are too short
  writeBytes(folder / "junk.bag", "not a bag");
  EXPECT_TRUE(saysInOneLine(inputError([&] { openBag(folder / "junk.bag"); }), "junk.bag"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { openBag(folder / "none.bag"); }), "none.bag"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { openRecording(folder / "none"); }), "none"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { openRecording(folder / "lab/captures/000.bin"); }), "000.bin", "--radar"));
  EXPECT_TRUE(
      saysInOneLine(inputError([&] { openRecording(folder / "lab.bag", "radar.yaml"); }), "lab.bag", "--radar"));
}

TEST(Bag, FramesOfAnotherRadarAreRefused) {
  const TestFolder folder;
  writeSession(folder / "lab");
  sessionToBag(folder / "lab", folder / "lab.bag");
  {
    const rosbag::Bag in(folder / "lab.bag", rosbag::bagmode::Read);
    rosbag::Bag out(folder / "other.bag", rosbag::bagmode::Write);
    rosbag::View view(in);
    int count = 0;
    for (const rosbag::MessageInstance& message : view) {
      if (const auto cube = message.instantiate<mmradartwin_msgs::AdcCube>()) {
        if (++count == 5) cube->radar_hash ^= 1;
        out.write(message.getTopic(), message.getTime(), *cube);
      } else {
        out.write(message.getTopic(), message.getTime(), message);
      }
    }
  }
  const Recording recording = openBag(folder / "other.bag");
  EXPECT_EQ(framesOf(recording, recording.poses[0]).size(), 4u);
  EXPECT_TRUE(
      saysInOneLine(inputError([&] { framesOf(recording, recording.poses[1]); }), "pose '001'", "another radar"));
}

TEST(Bag, LostFramesOfASessionAreReportedAfterTheRestIsWritten) {
  const TestFolder folder;
  writeSession(folder / "lab");
  sessionToBag(folder / "lab", folder / "lab.bag");
  {
    const rosbag::Bag in(folder / "lab.bag", rosbag::bagmode::Read);
    rosbag::Bag out(folder / "cut.bag", rosbag::bagmode::Write);
    rosbag::View view(in);
    int count = 0;
    for (const rosbag::MessageInstance& message : view) {
      if (message.getTopic() == "/radar/adc" && ++count == 6) continue;
      out.write(message.getTopic(), message.getTime(), message, message.getConnectionHeader());
    }
  }
  const std::vector<PoseProblem> problems = bagToSession(folder / "cut.bag", folder / "out");
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems.front().pose, "001");
  EXPECT_TRUE(saysInOneLine(problems.front().message, "pose '001'", "cut.bag"));
  EXPECT_EQ(readBytes(folder / "out/captures/000.bin"), readBytes(folder / "lab/captures/000.bin"));
  EXPECT_EQ(std::filesystem::file_size(folder / "out/captures/001.bin"), 3u * 2048);
}

TEST(RealCapture, SurvivesABagRoundTripBitForBit) {
  const auto capture = dataFolder() / "openradar_indoor" / "xwr22xx_4lane_adc_data.bin";
  SKIP_WITHOUT(capture);
  const TestFolder folder;
  std::filesystem::create_directories(folder / "lab/captures");
  std::filesystem::copy_file(MMRADARTWIN_DSP_SOURCE "/test/data/openradar_indoor.yaml", folder / "lab/radar.yaml");
  std::filesystem::copy_file(capture, folder / "lab/captures/room.bin");
  writeBytes(folder / "lab/poses.csv", "pose,location,stamp,x,y,z,qx,qy,qz,qw\nroom,1,1700000000,0,0,1,0,0,0,1\n");
  writeBytes(folder / "lab/session.yaml",
             "format: mmradartwin_session/1\nradar: radar.yaml\nposes: poses.csv\ncaptures: captures/{pose}.bin\n");
  sessionToBag(folder / "lab", folder / "lab.bag");
  bagToSession(folder / "lab.bag", folder / "back");
  EXPECT_EQ(contentsOf(folder / "back"), contentsOf(folder / "lab"));
  const Recording session = openSession(folder / "lab"), bag = openBag(folder / "lab.bag");
  expectSameFrames(session, bag);
  const SignalChain chain(session.radar);
  EXPECT_TRUE(chain.map(averagePose(session, session.poses[0])).power_db ==
              chain.map(averagePose(bag, bag.poses[0])).power_db);
}

TEST(Bag, AMessageThatSaysItIsLongerThanItIsTakesNoMemory) {
  const TestFolder folder;
  writeLiveBag(folder / "live.bag");
  std::string bytes = readBytes(folder / "live.bag");
  const std::string samples("\x00\x04\x00\x00\x05\x00\x05\x00", 8);  // 1024 of them, the first two
  const std::size_t at = bytes.find(samples);
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 4, "\xff\xff\xff\x7f");
  writeBytes(folder / "live.bag", bytes);
  EXPECT_TRUE(
      saysInOneLine(inputError([&] { openBag(folder / "live.bag"); }), "live.bag", "damaged", "longer than it is"));
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  EXPECT_LT(usage.ru_maxrss, 1 << 20) << "kB; ROS makes room for 2147483647 samples first";
}

}  // namespace
}  // namespace mmradartwin
