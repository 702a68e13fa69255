// Bags as others record them: parts of a split one, several radars, clocks that differ, stamps that say nothing, tf
// that contradicts itself. Each is read or refused with its very cause.
#include <gtest/gtest.h>
#include <ros/time.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include "mmradartwin_dsp/ros/bag.h"
#include "mmradartwin_dsp/ros/bag_validation.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/tf_warning_count.h"
#include "test_session_folder.h"

namespace mmradartwin {
namespace {

constexpr int kFrames = 140;
constexpr double kPeriod_s = 0.05;

geometry_msgs::TransformStamped transform(const std::string& parent, const std::string& child, double x) {
  geometry_msgs::TransformStamped T;
  T.header.frame_id = parent;
  T.child_frame_id = child;
  T.transform.translation.x = x;
  T.transform.rotation.w = 1;
  return T;
}

tf2_msgs::TFMessage message(const geometry_msgs::TransformStamped& T) {
  tf2_msgs::TFMessage tf;
  tf.transforms = {T};
  return tf;
}

/// One bag, or several into which messages go by their time.
class Recorder {
 public:
  Recorder(const std::vector<std::string>& files, double part_s = 1e9) : part_s_(part_s) {
    for (const std::string& file : files) {
      bags_.push_back(std::make_unique<rosbag::Bag>(file, rosbag::bagmode::Write));
    }
  }

  template <typename Message>
  void write(const std::string& topic, double at_s, const Message& message, const std::string& publisher) {
    const auto header = boost::make_shared<ros::M_string>();
    (*header)["callerid"] = publisher;
    (*header)["topic"] = topic;
    (*header)["type"] = ros::message_traits::datatype(message);
    (*header)["md5sum"] = ros::message_traits::md5sum(message);
    (*header)["message_definition"] = ros::message_traits::definition(message);
    const std::size_t part = std::min(bags_.size() - 1, static_cast<std::size_t>(std::max(0.0, at_s / part_s_)));
    bags_[part]->write(topic, ros::Time(1700000000) + ros::Duration(at_s), message, header);
  }

 private:
  double part_s_;
  std::vector<std::unique_ptr<rosbag::Bag>> bags_;
};

/// A radar on a cart: it stands for 3 s, is pushed by 2 m in 1 s, and stands again.
struct Drive {
  std::vector<std::string> radars = {""};                                  ///< namespaces
  std::vector<std::string> radar_frames = {"radar_link"};                  ///< of each
  std::function<double(double)> frame_stamp = [](double t) { return t; };  ///< of what was taken at t
  std::function<double(double)> tf_stamp = [](double t) { return t; };
  std::function<void(Recorder&, double t, double x)> also = [](Recorder&, double, double) {};  ///< at each frame
  std::function<void(Recorder&)> at_first = [](Recorder&) {};

  static double place(double t) { return t < 3 ? 0 : t < 4 ? (t - 3) * 2 : 2; }
  static constexpr double kNone = -1e9;
  static ros::Time time(double t) { return t == kNone ? ros::Time() : ros::Time(1700000000) + ros::Duration(t); }

  void record(Recorder& recorder) const {
    const RadarConfig radar = paperRadar();
    for (std::size_t i = 0; i < radars.size(); ++i) {
      recorder.write(radars[i] + "/radar/config", 0, toMsg(radar), "/radar_driver");
      recorder.write("/tf_static", 0, message(transform("cart", radar_frames[i], 0.1 + static_cast<double>(i))),
                     "/mount");
    }
    at_first(recorder);
    for (int i = 0; i < kFrames; ++i) {
      const double t = i * kPeriod_s;
      auto T = transform("map", "cart", place(t));
      T.header.stamp = time(tf_stamp(t));
      recorder.write("/tf", t + 0.002, message(T), "/slam");
      also(recorder, t, place(t));
      for (std::size_t r = 0; r < radars.size(); ++r) {
        AdcCube cube;
        cube.chirps = 2, cube.samples = 64, cube.receivers = 4;
        cube.data.assign(2 * 64 * 4 * 2, static_cast<std::int16_t>(5 + r));
        cube.chirp_valid.assign(2, 1);
        cube.sequence = static_cast<std::uint32_t>(i);
        auto msg = toMsg(cube, radarHash(radar));
        msg.header.frame_id = radar_frames[r];
        msg.header.stamp = time(frame_stamp(t + 0.001));
        recorder.write(radars[r] + "/radar/adc", t + 0.06, msg, "/radar_driver");
      }
    }
  }

  void write(const std::string& file) const {
    Recorder recorder({file});
    record(recorder);
  }
};

std::string errorOf(const std::string& file, const BagOptions& options = {}) {
  return inputError([&] { openBag(file, options); });
}

void expectTheTwoPlaces(const Recording& recording, double mount_x = 0.1) {
  ASSERT_EQ(recording.poses.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    const auto& pose = recording.poses[static_cast<std::size_t>(i)];
    EXPECT_NEAR(pose.T_map_radar.translation().x(), mount_x + 2 * i, 1e-9);
    EXPECT_NEAR(static_cast<double>(framesOf(recording, pose).size()), 60, 2);
  }
}

TEST(ForeignBags, ABagIsKnownByItsBytes) {
  const TestFolder folder;
  for (const char* name : {"lab.bag.active", "LAB.BAG", "lab", "lab.bin"}) {
    Drive().write(folder / name);
    expectTheTwoPlaces(openRecording(folder / name));
    std::filesystem::remove(folder / name);
  }
  Drive().write(folder / "lab.bag.active");
  EXPECT_EQ(openRecording(folder / "lab.bag.active").name, "lab");
  EXPECT_TRUE(saysInOneLine(inputError([&] { openSession(folder / "lab.bag.active"); }), "lab.bag.active", "is a bag",
                            "bag_to_session"));
  // What is called a bag and is none.
  for (const char* name : {"no.BAG", "no.bag.active"}) {
    writeBytes(folder / name, "junk");
    EXPECT_TRUE(saysInOneLine(inputError([&] { openRecording(folder / name); }), name, "cannot be read as a bag"));
  }
}

TEST(ForeignBags, OtherRecordingsAreNamed) {
  const TestFolder folder;
  writeBytes(folder / "a.mcap", "\x89MCAP0\r\n....");
  EXPECT_TRUE(
      saysInOneLine(inputError([&] { openRecording(folder / "a.mcap"); }), "a.mcap", "ROS 2", "rosbags-convert"));
  writeBytes(folder / "two/a_0.db3", std::string("SQLite format 3\0....", 20));
  EXPECT_TRUE(saysInOneLine(inputError([&] { openRecording(folder / "two/a_0.db3"); }), "a_0.db3", "ROS 2"));
  writeBytes(folder / "two/metadata.yaml", "rosbag2_bagfile_information:\n");
  EXPECT_TRUE(saysInOneLine(inputError([&] { openRecording(folder / "two"); }), "two", "ROS 2", "metadata.yaml"));
  writeBytes(folder / "old.bag", "#ROSBAG V1.2\n");
  EXPECT_TRUE(saysInOneLine(inputError([&] { openRecording(folder / "old.bag"); }), "old.bag", "rosbag fix"));
  std::filesystem::create_directories(folder / "day");
  Drive().write(folder / "day/lab_0.bag");
  EXPECT_TRUE(saysInOneLine(inputError([&] { openRecording(folder / "day"); }), "1 bag(s)", "day/lab_0.bag"));
}

TEST(ForeignBags, ABagWithoutIndexSaysHowToGetOne) {
  const TestFolder folder;
  Drive drive;
  drive.at_first = [&](Recorder&) {};
  {
    Recorder recorder({folder / "lab.bag"});
    drive.record(recorder);
    std::filesystem::copy_file(folder / "lab.bag", folder / "cut.bag.active");  // not closed yet
  }
  EXPECT_TRUE(saysInOneLine(inputError([&] { openRecording(folder / "cut.bag.active"); }), "no index",
                            "rosbag reindex " + (folder / "cut.bag.active")));
}

TEST(ForeignBags, PartsOfASplitBagAreReadTogether) {
  const TestFolder folder;
  const std::vector<std::string> files = {folder / "lab_2026-11-29_0.bag", folder / "lab_2026-11-29_1.bag",
                                          folder / "lab_2026-11-29_2.bag"};
  {
    Recorder recorder(files, 2.5);
    Drive().record(recorder);
  }
  BagOptions options;
  options.further = {files[2], files[0]};  // in any order
  expectTheTwoPlaces(openBag(files[1], options));
  bagToSession(files[1], folder / "out", {}, options);
  EXPECT_EQ(openSession(folder / "out").poses.size(), 2u);
  for (const BagFinding& f : validateBag(files[1], options)) ADD_FAILURE() << f.what << "; " << f.first;

  // A later part alone lacks what is latched.
  EXPECT_TRUE(saysInOneLine(errorOf(files[1]), "lab_2026-11-29_1.bag", "part 1", "latched", "/tf_static", files[0]));
  std::filesystem::rename(files[2], folder / "rest.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "rest.bag"), "rest.bag", "radar/config", "first part"));
  // With the radar's configuration, as --repeat-latched of that topic alone or another recorder brings it, the mount is
  // still in the first part.
  {
    const rosbag::Bag from(files[1], rosbag::bagmode::Read);
    rosbag::Bag to(folder / "half_1.bag", rosbag::bagmode::Write);
    to.write("/radar/config", ros::Time(1700000003), toMsg(paperRadar()));
    rosbag::View view(from);
    for (const rosbag::MessageInstance& m : view) to.write(m.getTopic(), m.getTime(), m, m.getConnectionHeader());
  }
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "half_1.bag"), "does not connect map -> radar_link", "map", "part 1",
                            "/tf_static"));
  // The first part alone can be read; that there is more is said.
  std::vector<std::string> notes;
  options.further.clear();
  options.on_note = [&notes](const std::string& note) { notes.push_back(note); };
  EXPECT_EQ(openBag(files[0], options).poses.size(), 1u);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_TRUE(saysInOneLine(notes[0], files[1], "not read"));
  // A recorder that begins anew leaves bags of such names, too, each a recording of its own.
  Drive().write(folder / "day_0.bag");
  Drive().write(folder / "day_1.bag");
  openBag(folder / "day_0.bag", options);
  EXPECT_EQ(notes.size(), 1u);
}

TEST(ForeignBags, BagsThatAreNotOneRecording) {
  const TestFolder folder;
  Drive().write(folder / "a.bag");
  std::filesystem::copy_file(folder / "a.bag", folder / "copy.bag");
  BagOptions options;
  options.further = {folder / "a.bag"};
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "a.bag", options), "given twice", "a.bag"));
  options.further = {folder / "copy.bag"};
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "a.bag", options), "in two of the bags", "1700000000.001"));
  options.further = {folder / "none.bag"};
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "a.bag", options), "none.bag", "no such bag"));
  writeSession(folder / "lab");
  options.further = {folder / "a.bag"};
  EXPECT_TRUE(saysInOneLine(inputError([&] { openRecording(folder / "lab", "", std::nullopt, options); }), "lab",
                            "only bags are read together"));
}

TEST(ForeignBags, OneOfSeveralRadarsIsChosen) {
  const TestFolder folder;
  Drive drive;
  drive.radars = {"/left", "/right"};
  drive.radar_frames = {"left_radar", "right_radar"};
  drive.write(folder / "two.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "two.bag"), "2 radars", "/left/radar/adc", "/right/radar/adc",
                            "--radar /left or --radar /right"));
  int counts = 5;
  for (const char* name : {"/left", "right/"}) {  // each in the frame that its own frames name
    const Recording recording = openRecording(folder / "two.bag", name);
    expectTheTwoPlaces(recording, counts == 5 ? 0.1 : 1.1);
    EXPECT_EQ(framesOf(recording, recording.poses[0])[0].data[0], counts++);
  }
  EXPECT_TRUE(saysInOneLine(inputError([&] { openRecording(folder / "two.bag", "middle"); }), "middle/radar/adc",
                            "/left/radar/adc"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { openRecording(folder / "two.bag", "radar.yaml"); }), "two.bag",
                            "brings its own radar", "--radar"));
  // One of them may have no namespace.
  drive.radars = {"", "/right"};
  drive.write(folder / "bare.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "bare.bag"), "2 radars", "--radar / or --radar /right"));
  expectTheTwoPlaces(openRecording(folder / "bare.bag", "/"));
  const auto found = validateBag(folder / "bare.bag");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(contains(found[0].what, "several radars"));
}

TEST(ForeignBags, TwoRadarsOnOneTopicAreNotAveraged) {
  const TestFolder folder;
  // Two drivers without a namespace: the same mount's name, or each its own.
  for (const char* frame : {"radar_link", "radar_2"}) {
    Drive drive;
    drive.also = [frame](Recorder& recorder, double t, double) {
      AdcCube cube;
      cube.chirps = 2, cube.samples = 64, cube.receivers = 4;
      cube.data.assign(2 * 64 * 4 * 2, 90);
      cube.chirp_valid.assign(2, 1);
      auto msg = toMsg(cube, radarHash(paperRadar()));
      msg.header.frame_id = frame;
      msg.header.stamp = Drive::time(t + 0.02);
      recorder.write("/radar/adc", t + 0.08, msg, "/radar_driver_2");
    };
    drive.write(folder / "mixed.bag");
    EXPECT_TRUE(saysInOneLine(errorOf(folder / "mixed.bag"), "/radar/adc are of several radars",
                              "radar_link (published by /radar_driver)",
                              std::string(frame) + " (published by /radar_driver_2)"));
  }
  // A driver that was started anew is the same radar.
  {
    const std::vector<std::string> parts = {folder / "before_0.bag", folder / "before_1.bag"};
    Recorder recorder(parts, 3.5);
    Drive().record(recorder);
  }
  {
    const rosbag::Bag before(folder / "before_0.bag", rosbag::bagmode::Read);
    const rosbag::Bag after(folder / "before_1.bag", rosbag::bagmode::Read);
    rosbag::Bag to(folder / "anew.bag", rosbag::bagmode::Write);
    rosbag::View first(before), second(after);
    for (const rosbag::MessageInstance& m : first) to.write(m.getTopic(), m.getTime(), m, m.getConnectionHeader());
    for (const rosbag::MessageInstance& m : second) {
      const auto header = boost::make_shared<ros::M_string>(*m.getConnectionHeader());
      (*header)["callerid"] += "_restarted";
      to.write(m.getTopic(), m.getTime(), m, header);
    }
  }
  expectTheTwoPlaces(openBag(folder / "anew.bag"));
}

TEST(ForeignBags, ClocksThatDifferAreMeasured) {
  const TestFolder folder;
  for (const double offset_s : {112.0, -40.0, 3.0e6}) {
    Drive drive;
    drive.frame_stamp = [offset_s](double t) { return t + offset_s; };
    drive.write(folder / "clocks.bag");
    char option[60];
    std::snprintf(option, sizeof option, "--clock-offset %.1f", offset_s - 0.06);  // the time that a frame takes
    const std::string error = errorOf(folder / "clocks.bag");
    EXPECT_TRUE(saysInOneLine(error, "clocks", offset_s > 0 ? "s later than" : "s earlier than", "map -> cart", "/slam",
                              "ntp"));
    if (offset_s == 112) {
      EXPECT_TRUE(contains(error, "112 s later")) << error;
    }
    EXPECT_TRUE(contains(error, option)) << error;
    BagOptions options;
    options.clock_offset_s = offset_s;
    expectTheTwoPlaces(openBag(folder / "clocks.bag", options));
    // A wrong one is told the whole of it again.
    options.clock_offset_s = -offset_s;
    EXPECT_TRUE(saysInOneLine(errorOf(folder / "clocks.bag", options), option));
    const auto found = validateBag(folder / "clocks.bag");
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [](const auto& f) { return contains(f.first, "clocks"); }));
  }
}

TEST(ForeignBags, ClocksDifferThoughFramesAndTransformsOverlap) {
  // Longer than the clocks differ: every frame finds a pose, and none its own.
  const TestFolder folder;
  Drive drive;
  drive.tf_stamp = [](double t) { return t + 6; };
  drive.write(folder / "clocks.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "clocks.bag"), "6.1 s earlier", "clocks of two computers"));
}

TEST(ForeignBags, FramesAndTransformsOfDifferentTimes) {
  // Recorded one after the other, or written with their stamps as times of recording: no clock tells which.
  const TestFolder folder;
  Drive drive;
  drive.write(folder / "live.bag");
  {
    const rosbag::Bag from(folder / "live.bag", rosbag::bagmode::Read);
    rosbag::Bag to(folder / "apart.bag", rosbag::bagmode::Write);
    rosbag::View view(from);
    for (const rosbag::MessageInstance& m : view) {
      if (auto cube = m.instantiate<mmradartwin_msgs::AdcCube>()) {
        cube->header.stamp += ros::Duration(112);
        to.write(m.getTopic(), cube->header.stamp, *cube);
      } else {
        to.write(m.getTopic(), m.getTime(), m, m.getConnectionHeader());
      }
    }
  }
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "apart.bag"), "no time in common", "112 s later", "1700000112.",
                            "--clock-offset 112.0"));
  BagOptions options;
  options.clock_offset_s = 112;
  expectTheTwoPlaces(openBag(folder / "apart.bag", options));
}

TEST(ForeignBags, TransformsOfALaterReckoningAreNoClock) {
  // tf computed afterwards and added with the time of writing; its stamps are true.
  const TestFolder folder;
  Drive().write(folder / "live.bag");
  {
    const rosbag::Bag from(folder / "live.bag", rosbag::bagmode::Read);
    rosbag::Bag to(folder / "reckoned.bag", rosbag::bagmode::Write);
    rosbag::View view(from);
    for (const rosbag::MessageInstance& m : view) {
      to.write(m.getTopic(), m.getTime() + ros::Duration(m.getTopic() == "/tf" ? 3600 : 0), m, m.getConnectionHeader());
    }
  }
  expectTheTwoPlaces(openBag(folder / "reckoned.bag"));
}

TEST(ForeignBags, StampsThatTellNoTime) {
  const TestFolder folder;
  Drive drive;
  drive.frame_stamp = [](double) { return Drive::kNone; };
  drive.write(folder / "zero.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "zero.bag"), "zero.bag", "/radar/adc", "all zero", "driver did not stamp",
                            "header.stamp"));
  drive.frame_stamp = [](double) { return 1.5; };
  drive.write(folder / "same.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "same.bag"), "/radar/adc", "all the same (1700000001.5 s)"));
  drive = Drive();
  drive.tf_stamp = [](double) { return Drive::kNone; };
  drive.write(folder / "tf.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "tf.bag"), "map -> cart", "/slam", "all zero", "publisher did not stamp"));
}

TEST(ForeignBags, TwoParentsOfAFrameAreBothNamed) {
  const TestFolder folder;
  // Odometry and SLAM both say where the cart is, in turn.
  Drive drive;
  drive.also = [](Recorder& recorder, double t, double x) {
    auto T = transform("odom", "cart", x + 7);
    T.header.stamp = Drive::time(t + 0.01);
    recorder.write("/tf", t + 0.012, message(T), "/ekf");
  };
  drive.write(folder / "odom.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "odom.bag"), "cart has 2 parents", "map (published by /slam)",
                            "odom (published by /ekf)"));
  // So even where odom is connected to the map, and where the second begins late.
  drive.at_first = [](Recorder& recorder) {
    recorder.write("/tf_static", 0, message(transform("map", "odom", 1)), "/odom_start");
  };
  drive.write(folder / "both.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "both.bag"), "cart has 2 parents", "/slam", "/ekf"));
  // A static parent beside a moving one.
  drive = Drive();
  drive.at_first = [](Recorder& recorder) {
    recorder.write("/tf_static", 0, message(transform("lidar", "radar_link", 0.3)), "/lidar_mount");
  };
  drive.write(folder / "mounts.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "mounts.bag"), "radar_link has 2 parents", "cart (published by /mount)",
                            "lidar (published by /lidar_mount)"));
  const auto found = validateBag(folder / "mounts.bag");
  EXPECT_TRUE(std::any_of(found.begin(), found.end(), [](const auto& f) { return contains(f.first, "2 parents"); }));
  // A parent that takes over for good and hangs below nothing loses the second half.
  drive = Drive();
  drive.tf_stamp = [](double t) { return std::min(t, 3.5 + 1e-6 * t); };
  drive.also = [](Recorder& recorder, double t, double x) {
    if (t < 4) return;
    auto T = transform("odom", "cart", x);
    T.header.stamp = Drive::time(t);
    recorder.write("/tf", t, message(T), "/ekf");
  };
  drive.write(folder / "late.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "late.bag"), "cart has 2 parents", "/slam", "/ekf"));
}

TEST(ForeignBags, WhatDoesNotConcernTheRadarIsNoContradiction) {
  const TestFolder folder;
  Drive drive;
  drive.at_first = [](Recorder& recorder) {
    for (const char* parent : {"cart", "map", "table"}) {
      recorder.write("/tf_static", 0, message(transform(parent, "camera", 1)), std::string("/at_") + parent);
    }
    // Above the map, too, and the same mount once more, as a recorder repeats what is latched.
    recorder.write("/tf_static", 0, message(transform("earth", "map", 1)), "/gps");
    recorder.write("/tf_static", 0, message(transform("world", "map", 1)), "/survey");
    recorder.write("/tf_static", 1, message(transform("cart", "radar_link", 0.1)), "/record");
  };
  drive.write(folder / "camera.bag");
  expectTheTwoPlaces(openBag(folder / "camera.bag"));
  // A cart that is handed over from one map to another that hangs below it.
  drive = Drive();
  drive.at_first = [](Recorder& recorder) {
    recorder.write("/tf_static", 0, message(transform("map", "hall", 1)), "/halls");
  };
  {
    Recorder recorder({folder / "handed.bag"});
    drive.record(recorder);
    for (int i = kFrames; i < 2 * kFrames; ++i) {
      auto T = transform("hall", "cart", 3);
      T.header.stamp = Drive::time(i * kPeriod_s);
      recorder.write("/tf", i * kPeriod_s, message(T), "/slam");
    }
  }
  expectTheTwoPlaces(openBag(folder / "handed.bag"));
}

TEST(ForeignBags, TwoMountsAreBothNamed) {
  const TestFolder folder;
  Drive drive;
  drive.at_first = [](Recorder& recorder) {
    recorder.write("/tf_static", 0.5, message(transform("cart", "radar_link", 0.6)), "/mount_of_last_year");
  };
  drive.write(folder / "mounts.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "mounts.bag"), "two static transforms of cart -> radar_link",
                            "0.500 m and 0.0 deg apart", "0.100 0.000 0.000 m", "published by /mount)",
                            "0.600 0.000 0.000 m", "published by /mount_of_last_year)"));
  // Turned, from the same publisher, told anew.
  drive.at_first = [](Recorder& recorder) {
    auto T = transform("cart", "radar_link", 0.1);
    T.transform.rotation.z = std::sin(M_PI / 12);
    T.transform.rotation.w = std::cos(M_PI / 12);
    recorder.write("/tf_static", 4, message(T), "/mount");
  };
  drive.write(folder / "turned.bag");
  EXPECT_TRUE(
      saysInOneLine(errorOf(folder / "turned.bag"), "0.000 m and 30.0 deg apart", "yaw pitch roll 30.0 0.0 0.0"));
  // Static and moving at once.
  drive = Drive();
  drive.also = [](Recorder& recorder, double t, double) {
    auto T = transform("cart", "radar_link", 0.4);
    T.header.stamp = Drive::time(t);
    recorder.write("/tf", t, message(T), "/robot_state_publisher");
  };
  drive.write(folder / "moving.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "moving.bag"), "cart -> radar_link is in tf_static (published by /mount)",
                            "in tf (published by /robot_state_publisher)", "0.300 m"));
  // Two who say where the cart is, and differ.
  drive.also = [](Recorder& recorder, double t, double x) {
    auto T = transform("map", "cart", x + 0.5);
    T.header.stamp = Drive::time(t + 0.01);
    recorder.write("/tf", t + 0.012, message(T), "/amcl");
  };
  drive.write(folder / "slams.bag");
  EXPECT_TRUE(saysInOneLine(errorOf(folder / "slams.bag"), "map -> cart is published by /slam and by /amcl"));
}

TEST(ForeignBags, WarningsOfTf2AreCountedInOneLine) {
  const TestFolder folder;
  Drive drive;
  drive.also = [](Recorder& recorder, double t, double x) {  // each said again, as two recorders' bags merged do
    auto T = transform("map", "cart", x);
    T.header.stamp = Drive::time(t);
    recorder.write("/tf", t + 0.003, message(T), "/slam");
  };
  drive.at_first = [](Recorder& recorder) {
    auto T = transform("cart", "cart", 0);
    for (int i = 0; i < 30; ++i) recorder.write("/tf", 0, message(T), "/odd");
  };
  drive.write(folder / "twice.bag");
  std::vector<std::string> notes;
  BagOptions options;
  options.on_note = [&notes](const std::string& note) { notes.push_back(note); };
  testing::internal::CaptureStderr();
  const Recording recording = openBag(folder / "twice.bag", options);
  recording.withPoseLag(0.01);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  expectTheTwoPlaces(recording);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_TRUE(saysInOneLine(notes[0], "twice.bag: tf2 left out 170 transform(s)", "140 by TF_REPEATED_DATA", "/slam",
                            "30 by TF_SELF_TRANSFORM"));
  notes.clear();
  Drive().write(folder / "once.bag");
  openBag(folder / "once.bag", options);
  EXPECT_TRUE(notes.empty());
}

TEST(ForeignBags, WarningsOfAListenerAreOneLineToo) {
  countTfWarningsOfProcess(3600);
  tf2::BufferCore buffer;
  testing::internal::CaptureStderr();
  for (int i = 0; i < 200; ++i) {
    auto T = transform("map", "cart", 1);
    T.header.stamp = ros::Time(5);
    buffer.setTransform(T, "/slam", false);
  }
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(contains(said, "tf2 left out 1 transform(s)")) << said;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
}

}  // namespace
}  // namespace mmradartwin
