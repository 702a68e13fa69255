// A clean live recording has no findings; each fault put into it is found, counted and placed.
#include "mmradartwin_dsp/ros/bag_validation.h"

#include <gtest/gtest.h>
#include <mmradartwin_msgs/AdcCube.h>
#include <ros/time.h>
#include <rosbag/bag.h>
#include <sys/wait.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdlib>

#include "mmradartwin_dsp/ros/conversions.h"
#include "test_session_folder.h"

namespace mmradartwin {
namespace {

constexpr int kFrames = 100;

struct Scene {
  std::vector<std::string> namespaces = {""};
  bool config = true, tf = true;
  std::string map_frame = "map";
  std::function<void(int, mmradartwin_msgs::AdcCube&)> change_cube = [](int, mmradartwin_msgs::AdcCube&) {};
  std::function<bool(int)> keep_cube = [](int) { return true; };
  std::function<void(int, geometry_msgs::TransformStamped&)> change_tf = [](int, geometry_msgs::TransformStamped&) {};
  std::function<bool(int)> keep_tf = [](int) { return true; };
  std::function<void(rosbag::Bag&)> add = [](rosbag::Bag&) {};
};

const std::int64_t kStart_ns = 1'700'000'000'000'000'000;

/// The radar stands for 5 s; frames and transforms 20 times a second.
std::string writeBag(const TestFolder& folder, const Scene& scene) {
  const std::string file = folder / "live.bag";
  std::filesystem::remove(file);
  rosbag::Bag bag(file, rosbag::bagmode::Write);
  const RadarConfig radar = paperRadar();
  const auto period_ns = radar.frame_offset_ns(1);
  for (int i = 0; i < kFrames; ++i) {
    const ros::Time at = toRosTime(kStart_ns + i * period_ns);
    if (scene.tf && scene.keep_tf(i)) {
      tf2_msgs::TFMessage tf;
      tf.transforms.resize(1);
      tf.transforms[0].header.stamp = at;
      tf.transforms[0].header.frame_id = scene.map_frame;
      tf.transforms[0].child_frame_id = "radar_link";
      tf.transforms[0].transform.translation.x = 1;
      tf.transforms[0].transform.rotation.w = 1;
      scene.change_tf(i, tf.transforms[0]);
      bag.write("/tf", at, tf);
    }
    for (const std::string& ns : scene.namespaces) {
      if (i == 0 && scene.config) bag.write(ns + "/radar/config", at, toMsg(radar));
      if (!scene.keep_cube(i)) continue;
      AdcCube cube;
      cube.chirps = 2, cube.samples = 64, cube.receivers = 4;
      cube.stamp_ns = kStart_ns + i * period_ns;
      cube.sequence = static_cast<std::uint32_t>(i);
      cube.data.assign(2 * 64 * 4 * 2, 5);
      for (std::size_t j = 0; j < cube.data.size(); j += 3) cube.data[j] = 6;  // no lane is constant
      cube.chirp_valid.assign(2, 1);
      mmradartwin_msgs::AdcCube message = toMsg(cube, radarHash(radar));
      scene.change_cube(i, message);
      bag.write(ns + "/radar/adc", at, message);
    }
  }
  scene.add(bag);
  bag.close();
  return file;
}

/// The only finding but `besides`, as "count what; first".
std::string finding(const Scene& scene, const std::vector<std::string>& besides = {}) {
  const TestFolder folder;
  std::string text;
  for (const BagFinding& found : validateBag(writeBag(folder, scene))) {
    const bool expected = std::any_of(besides.begin(), besides.end(),
                                      [&](const std::string& part) { return contains(found.what, part); });
    if (expected) continue;
    text += (text.empty() ? "" : "\n") + std::to_string(found.count) + " " + found.what + "; " + found.first;
  }
  return text;
}

TEST(ValidateBag, CleanRecordingHasNoFindings) { EXPECT_EQ(finding({}), ""); }

TEST(ValidateBag, CleanSessionHasNoFindings) {
  const TestFolder folder;
  writeSession(folder / "lab");
  const RadarConfig radar = paperRadar();
  for (const char* pose : {"000", "001", "002"}) {
    writeBytes(folder / ("lab/captures/" + std::string(pose) + ".bin"), std::string(4 * radar.bytes_per_frame(), 3));
  }
  sessionToBag(folder / "lab", folder / "lab.bag");
  for (const BagFinding& found : validateBag(folder / "lab.bag")) ADD_FAILURE() << found.what << "; " << found.first;
}

TEST(ValidateBag, Configurations) {
  Scene scene;
  scene.config = false;
  EXPECT_EQ(finding(scene, {"no pose"}), "1 no radar configuration on radar/config: record it too (it is latched); ");
  scene.config = true;
  scene.add = [](rosbag::Bag& bag) {
    RadarConfig other = paperRadar();
    other.carrier_hz = 76e9;
    bag.write("/radar/config", toRosTime(kStart_ns + 7'000'000'000), toMsg(other));
    bag.write("/radar/config", toRosTime(kStart_ns + 8'000'000'000), toMsg(other));
  };
  EXPECT_EQ(finding(scene, {"no pose"}), "1 further radar configuration(s); recorded at 1700000007 s");
}

TEST(ValidateBag, Frames) {
  Scene scene;
  scene.keep_cube = [](int i) { return i != 20 && i != 21 && i != 50; };
  EXPECT_EQ(finding(scene), "3 frame(s) missing in the sequence; before frame 22 at 1700000001.1 s");

  scene = Scene();
  scene.change_cube = [](int i, mmradartwin_msgs::AdcCube& cube) {
    if (i == 30 || i == 31) cube.lost_bytes = 100, cube.chirp_valid[1] = 0;
  };
  EXPECT_EQ(finding(scene),
            "2 frame(s) with lost bytes; frame 30 at 1700000001.5 s\n2 invalid chirp(s); frame 30 at 1700000001.5 s\n"
            "200 byte(s) lost in all; ");

  scene = Scene();
  scene.change_cube = [](int i, mmradartwin_msgs::AdcCube& cube) {
    if (i == 40) cube.header.stamp += ros::Duration(0.003);
  };
  EXPECT_EQ(finding(scene), "2 frame(s) whose stamp is off the frame period; frame 40 at 1700000002.003 s");

  scene = Scene();
  scene.change_cube = [](int i, mmradartwin_msgs::AdcCube& cube) {
    if (i >= 60) cube.samples[3] = 32767, cube.samples[4] = -32768;
  };
  EXPECT_EQ(finding(scene), "80 saturated sample(s); frame 60 at 1700000003 s");

  scene = Scene();
  scene.change_cube = [](int, mmradartwin_msgs::AdcCube& cube) {
    for (std::size_t i = 0; i < cube.samples.size(); ++i) {
      if (i / 2 % 4 == 2) cube.samples[i] = 0;
    }
  };
  EXPECT_EQ(finding(scene), "100 frame(s) in which receiver 2 is all zero; frame 0 at 1700000000 s");

  scene = Scene();
  scene.change_cube = [](int i, mmradartwin_msgs::AdcCube& cube) {
    if (i == 70) cube.radar_hash ^= 1;
  };
  EXPECT_EQ(finding(scene, {"without a usable frame"}),
            "1 frame(s) taken with another radar configuration than radar/config says; frame 70 at 1700000003.5 s");

  scene = Scene();
  scene.change_cube = [](int i, mmradartwin_msgs::AdcCube& cube) {
    if (i >= 50) cube.sequence -= 50;  // the card was armed anew
    if (i == 80) cube.sequence = 3;
    if (i == 81) cube.samples.pop_back();
  };
  EXPECT_EQ(finding(scene, {"missing in the sequence", "off the frame period", "without a usable frame"}),
            "1 frame(s) whose sequence goes back; frame 3 at 1700000004 s\n"
            "1 malformed frame(s); frame 31 at 1700000004.05 s: AdcCube: field samples has 1023 entries; "
            "its shape says 1024");
}

TEST(ValidateBag, Transforms) {
  Scene scene;
  scene.tf = false;
  EXPECT_TRUE(contains(finding(scene, {"no pose"}), "no tf: record /tf"));

  scene = Scene();
  scene.map_frame = "odom";
  EXPECT_EQ(finding(scene, {"no pose"}), "1 tf does not connect map -> radar_link; ");

  scene = Scene();
  scene.keep_tf = [](int i) { return i < 30 || i > 44; };
  EXPECT_EQ(finding(scene),
            "15 frame(s) within a gap in tf that the radar stood through; 1700000001.5 s, map -> radar_link");

  // Silent for 0.45 s while the radar was put 5 cm further: what tf interpolates there is no place where it was.
  scene = Scene();
  scene.keep_tf = [](int i) { return i < 30 || i > 37; };
  scene.change_tf = [](int i, geometry_msgs::TransformStamped& T) {
    if (i > 33) T.transform.translation.y = 0.05;
  };
  EXPECT_EQ(finding(scene),
            "8 frame(s) that have no pose, for what tf does there; 1700000001.5 s, map -> radar_link was silent for "
            "0.45 s, and another one afterwards\n"
            "1 gap(s) in tf at whose ends the radar stands elsewhere; 1700000001.9 s, map -> radar_link");
  // Frames that were not taken meanwhile have nothing to lose; whoever reads the bag should know of the gap.
  scene.keep_cube = [](int i) { return i < 30 || i > 37; };
  EXPECT_EQ(finding(scene, {"missing in the sequence"}),
            "1 gap(s) in tf at whose ends the radar stands elsewhere; 1700000001.9 s, map -> radar_link");

  scene = Scene();
  scene.keep_tf = [](int i) { return i < 80; };
  EXPECT_EQ(finding(scene), "10 frame(s) without a transform; 1700000004.5 s, map -> radar_link");

  scene = Scene();
  scene.change_tf = [](int i, geometry_msgs::TransformStamped& T) {
    if (i == 45) T.transform.translation.y = 0.5;
  };
  EXPECT_EQ(finding(scene), "2 jump(s) in tf; 1700000002.25 s, map -> radar_link");
  // A frame between the two transforms of a jump belongs to neither place.
  scene.change_cube = [](int i, mmradartwin_msgs::AdcCube& cube) {
    if (i == 45) cube.header.stamp -= ros::Duration(0.02);
  };
  EXPECT_EQ(finding(scene, {"off the frame period", "jump(s)"}),
            "1 frame(s) that have no pose, for what tf does there; 1700000002.23 s, map -> radar_link jumps there by "
            "0.50 m and 0 deg");

  scene = Scene();
  scene.change_tf = [](int i, geometry_msgs::TransformStamped& T) { T.transform.translation.y = 0.05 * i; };
  EXPECT_TRUE(contains(finding(scene), "no pose can be found; bag holds no pose")) << finding(scene);
}

TEST(ValidateBag, SeveralRadars) {
  Scene scene;
  scene.namespaces = {"/left", "/right"};
  scene.change_cube = [](int i, mmradartwin_msgs::AdcCube& cube) {
    if (i == 10) cube.samples[0] = 32767;
  };
  EXPECT_EQ(finding(scene),
            "2 several radars: programs need --radar to tell them apart; /left/radar/adc, /right/radar/adc\n"
            "1 /left: saturated sample(s); frame 10 at 1700000000.5 s\n"
            "1 /right: saturated sample(s); frame 10 at 1700000000.5 s");
  const TestFolder folder;
  BagOptions options;
  options.ns = "/left";
  EXPECT_EQ(validateBag(writeBag(folder, scene), options).size(), 1u);
}

TEST(ValidateBag, NoBag) {
  const TestFolder folder;
  EXPECT_FALSE(inputError([] { validateBag("/nowhere/a.bag"); }).empty());
  writeBytes(folder / "a.bag", "no bag");
  EXPECT_TRUE(saysInOneLine(inputError([&] { validateBag(folder / "a.bag"); }), "cannot be read as a bag"));
  // As a recorder leaves it that could not close it.
  Scene scene;
  scene.add = [&](rosbag::Bag& bag) { std::filesystem::copy_file(bag.getFileName(), folder / "cut.bag.active"); };
  writeBag(folder, scene);
  EXPECT_TRUE(saysInOneLine(inputError([&] { validateBag(folder / "cut.bag.active"); }),
                            "rosbag reindex " + (folder / "cut.bag.active")));
}

TEST(ValidateProgram, ExitStatus) {
  const TestFolder folder;
  const std::string command = std::string(MMRADARTWIN_VALIDATE) + " " + folder / "live.bag" + " >/dev/null 2>&1";
  Scene scene;
  writeBag(folder, scene);
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 0);
  scene.keep_cube = [](int i) { return i != 20; };
  writeBag(folder, scene);
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 2);
}

}  // namespace
}  // namespace mmradartwin
