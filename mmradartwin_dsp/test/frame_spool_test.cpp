#include "mmradartwin_dsp/ros/frame_spool.h"

#include <gtest/gtest.h>
#include <ros/time.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <algorithm>

#include "mmradartwin_dsp/ros/bag.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "test_session_folder.h"

namespace mmradartwin {
namespace {

/// A session and all that a live stream of it brings.
class Stream {
 public:
  Stream() {
    writeSession(folder_ / "lab", "", 6);
    sessionToBag(folder_ / "lab", bag_file());
    rosbag::Bag bag(bag_file(), rosbag::bagmode::Read);
    rosbag::View view(bag);
    for (const rosbag::MessageInstance& message : view) {
      if (const auto cube = message.instantiate<mmradartwin_msgs::AdcCube>()) cubes.push_back(cube);
      if (const auto config = message.instantiate<mmradartwin_msgs::RadarConfig>()) radar = *config;
      if (const auto sent = message.instantiate<mmradartwin_msgs::Session>()) session = *sent;
    }
  }
  std::string bag_file() const { return folder_ / "lab.bag"; }
  /// As poses.csv has it.
  Eigen::Isometry3d at(const mmradartwin_msgs::AdcCube& cube) const {
    const Recording recording = openSession(folder_ / "lab");
    const std::int64_t stamp_ns = toNanoseconds(cube.header.stamp);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    for (const Pose& pose : recording.poses) {
      if (pose.stamp_ns <= stamp_ns) T = pose.T_map_radar;
    }
    return T;
  }
  void play(FrameSpool& spool, std::size_t from, std::size_t to) const {
    for (std::size_t i = from; i < to; ++i) spool.add(cubes[i], at(*cubes[i]));
  }
  /// The same stream played again later or earlier.
  void playShifted(FrameSpool& spool, double shift_s, int frames) const {
    for (int i = 0; i < frames; ++i) {
      const auto cube = boost::make_shared<mmradartwin_msgs::AdcCube>(*cubes[static_cast<std::size_t>(i)]);
      cube->header.stamp += ros::Duration(shift_s);
      spool.add(cube, at(*cubes[static_cast<std::size_t>(i)]));
    }
  }

  mmradartwin_msgs::RadarConfig radar;
  mmradartwin_msgs::Session session;
  std::vector<mmradartwin_msgs::AdcCube::ConstPtr> cubes;  // 3 poses of 6 frames

 private:
  const TestFolder folder_;
};

std::vector<std::vector<std::int16_t>> samplesOf(const Recording& recording, std::size_t pose) {
  std::vector<std::vector<std::int16_t>> samples;
  for (const AdcCube& cube : framesOf(recording, recording.poses.at(pose))) samples.push_back(cube.data);
  return samples;
}

TEST(FrameSpool, PosesSeenSoFarReadAsFromABag) {
  const Stream stream;
  FrameSpool spool;
  spool.setRadar(stream.radar);
  spool.setSession(stream.session);
  stream.play(spool, 0, stream.cubes.size());
  const Recording live = spool.recording(), bag = openBag(stream.bag_file());
  ASSERT_EQ(live.poses.size(), 3u);
  ASSERT_EQ(bag.poses.size(), 3u);
  EXPECT_EQ(live.name, bag.name);
  EXPECT_EQ(live.duplicates, bag.duplicates);
  EXPECT_EQ(readBytes(*live.scene_file), readBytes(*bag.scene_file));
  EXPECT_EQ(toYaml(live.radar), toYaml(bag.radar));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(live.poses[i].name, bag.poses[i].name);
    EXPECT_EQ(live.poses[i].location, bag.poses[i].location);
    EXPECT_EQ(live.poses[i].stamp_ns, bag.poses[i].stamp_ns);
    EXPECT_TRUE(live.poses[i].T_map_radar.matrix() == bag.poses[i].T_map_radar.matrix());
    EXPECT_EQ(samplesOf(live, i), samplesOf(bag, i));
  }
}

TEST(FrameSpool, WhatComesLaterDoesNotShowAndWhatCameBeforeStays) {
  const Stream stream;
  FrameSpool spool;
  spool.setRadar(stream.radar);
  spool.setSession(stream.session);
  stream.play(spool, 0, 8);  // the first pose and two frames of the second
  const Recording early = spool.recording();
  stream.play(spool, 8, stream.cubes.size());
  const Recording late = spool.recording();
  ASSERT_EQ(early.poses.size(), 2u);
  ASSERT_EQ(late.poses.size(), 3u);
  EXPECT_EQ(samplesOf(early, 0).size(), 6u);
  EXPECT_EQ(samplesOf(early, 1).size(), 2u);
  EXPECT_EQ(samplesOf(late, 1).size(), 6u);
  EXPECT_EQ(samplesOf(late, 2).size(), 6u);
  EXPECT_EQ(samplesOf(early, 0), samplesOf(late, 0));
  // Read once more by another time of tf, beside a spool that goes on.
  ASSERT_EQ(early.track.size(), 8u);
  EXPECT_EQ(early.track[7].stamp_ns, toNanoseconds(stream.cubes[7]->header.stamp));
  std::vector<std::int64_t> stamps_ns;
  early.forEachFrameBetween(early.track[5].stamp_ns, early.track[6].stamp_ns,
                            [&](const AdcCube& cube) { stamps_ns.push_back(cube.stamp_ns); });
  EXPECT_EQ(stamps_ns, (std::vector<std::int64_t>{early.track[5].stamp_ns, early.track[6].stamp_ns}));
  EXPECT_EQ(samplesOf(early.withPoseLag(0), 2), samplesOf(late, 2));
  spool.forget();
  EXPECT_EQ(samplesOf(late, 2).size(), 6u);
  EXPECT_TRUE(saysInOneLine(inputError([&] { spool.recording(); }), "no frames", "radar/adc"));
}

TEST(FrameSpool, FramesThatComeBeforeTheRadarConfigurationWait) {
  const Stream stream;
  FrameSpool spool;
  stream.play(spool, 0, 6);
  EXPECT_TRUE(saysInOneLine(inputError([&] { spool.recording(); }), "radar/config"));
  spool.setRadar(stream.radar);
  spool.setSession(stream.session);
  EXPECT_EQ(spool.state().frames, 6u);
  EXPECT_EQ(samplesOf(spool.recording(), 0).size(), 6u);
}

TEST(FrameSpool, WithoutASessionAPoseIsWhereTheRadarStands) {
  const Stream stream;
  FrameSpool spool;
  spool.setRadar(stream.radar);
  for (int second = 0; second < 2; ++second) {
    for (int i = 0; i < 20; ++i) {
      const auto cube = boost::make_shared<mmradartwin_msgs::AdcCube>(*stream.cubes.front());
      cube->header.stamp = ros::Time(100 + second, 0) + ros::Duration(0.05 * i);
      spool.add(cube, Eigen::Isometry3d(Eigen::Translation3d(second, 0, 1)));
    }
  }
  const Recording recording = spool.recording();
  ASSERT_EQ(recording.poses.size(), 2u);
  EXPECT_NEAR(recording.poses[1].T_map_radar.translation().x(), 1, 1e-12);
  EXPECT_EQ(samplesOf(recording, 0).size(), 20u);
}

TEST(FrameSpool, BeginsAnewWithAnotherRadarAnotherSessionAndEarlierStamps) {
  const Stream stream;
  FrameSpool spool;
  spool.setRadar(stream.radar);
  spool.setSession(stream.session);
  stream.play(spool, 0, 12);
  spool.setRadar(stream.radar);
  spool.setSession(stream.session);
  EXPECT_EQ(spool.state().frames, 12u);
  const Recording before = spool.recording();

  stream.playShifted(spool, -100, 3);
  EXPECT_EQ(spool.state().frames, 3u);
  EXPECT_EQ(samplesOf(before, 1).size(), 6u);

  mmradartwin_msgs::Session other = stream.session;
  other.name = "other";
  spool.setSession(other);
  EXPECT_EQ(spool.state().frames, 0u);
  stream.play(spool, 0, 2);
  EXPECT_EQ(spool.recording().name, "other");

  mmradartwin_msgs::RadarConfig radar = stream.radar;
  radar.slope_hz_per_s *= 1.01;
  spool.setRadar(radar);
  stream.play(spool, 0, 2);  // taken with the one before
  EXPECT_EQ(spool.state().frames, 0u);
  EXPECT_EQ(spool.state().left_out, 2u);
}

TEST(FrameSpool, HoldsItsLimits) {
  const Stream stream;
  FrameSpoolLimits limits;
  limits.frames_per_pose = 4;
  FrameSpool few(limits);
  few.setRadar(stream.radar);
  few.setSession(stream.session);
  stream.play(few, 0, stream.cubes.size());
  EXPECT_EQ(few.state().frames, 12u);
  EXPECT_EQ(few.state().left_out, 6u);
  EXPECT_EQ(few.state().problem, "");
  EXPECT_EQ(samplesOf(few.recording(), 2).size(), 4u);

  limits = {};
  limits.max_bytes = 10'000;  // a frame has 2 kB
  FrameSpool small(limits);
  small.setRadar(stream.radar);
  small.setSession(stream.session);
  stream.play(small, 0, stream.cubes.size());
  EXPECT_LE(small.state().bytes, 10'000u);
  EXPECT_GE(small.state().frames, 3u);
  EXPECT_TRUE(contains(small.state().problem, "limit")) << small.state().problem;
  EXPECT_EQ(small.recording().poses.size(), 1u);

  limits = {};
  limits.min_free_bytes = std::uint64_t{1} << 60;
  FrameSpool full(limits);
  full.setRadar(stream.radar);
  stream.play(full, 0, 3);
  EXPECT_EQ(full.state().frames, 0u);
  EXPECT_TRUE(contains(full.state().problem, "free")) << full.state().problem;
  EXPECT_TRUE(saysInOneLine(inputError([&] { full.recording(); }), "no frames", "free"));

  limits = {};
  limits.folder = "/nowhere/at/all";
  EXPECT_TRUE(saysInOneLine(inputError([&] { FrameSpool spool(limits); }), "/nowhere/at/all"));
}

TEST(FrameSpool, LeavesNothingBehind) {
  const Stream stream;
  const TestFolder folder;
  FrameSpoolLimits limits;
  limits.folder = folder.path.string();
  {
    FrameSpool spool(limits);
    spool.setRadar(stream.radar);
    stream.play(spool, 0, 6);
    EXPECT_FALSE(std::filesystem::is_empty(folder.path));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path));
}

}  // namespace
}  // namespace mmradartwin
