// Content of what the node and the nodelet publish; signal_chain_node.test and signal_chain_nodelet.test run it.

#include <gtest/gtest.h>
#include <nodelet/NodeletUnload.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Log.h>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/transform_broadcaster.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "mmradartwin_dsp/coherent_average.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "test_radar.h"

namespace mmradartwin {
namespace {

constexpr double kPatience_s = 60;  // a loaded machine is slow, not wrong

/// Calls callbacks until `condition` holds; false where it does not within `patience_s`.
bool waitFor(const std::function<bool()>& condition, double patience_s = kPatience_s) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(patience_s);
  while (!condition()) {
    if (!ros::ok() || ros::WallTime::now() > end) return false;
    ros::WallDuration(0.005).sleep();
    ros::spinOnce();
  }
  return true;
}

template <typename Message>
class Inbox {
 public:
  Inbox(ros::NodeHandle& nh, const std::string& topic)
      : subscriber_(nh.subscribe<Message>(topic, 100,
                                          [this](const typename Message::ConstPtr& m) { messages.push_back(m); })) {}
  bool wait(std::size_t count) {
    return waitFor([&] { return messages.size() >= count; });
  }
  bool connected() const { return subscriber_.getNumPublishers() > 0; }
  bool endsWith(const ros::Time& stamp) const { return !messages.empty() && messages.back()->header.stamp == stamp; }
  std::vector<typename Message::ConstPtr> messages;

 private:
  ros::Subscriber subscriber_;
};

class SignalChainNodeTest : public ::testing::Test {
 protected:
  SignalChainNodeTest()
      : radar_(paperRadar()),
        hash_(radarHash(radar_)),
        grids_(nh_, "radar/grid"),
        maps_(nh_, "radar/range_angle"),
        twin_maps_(nh_, "twin/range_angle"),
        log_(nh_, "/rosout"),
        config_(nh_.advertise<mmradartwin_msgs::RadarConfig>("radar/config", 1, true)),
        cubes_(nh_.advertise<mmradartwin_msgs::AdcCube>("radar/adc", 100)),
        twin_(nh_.advertise<mmradartwin_msgs::ReceiveGrid>("twin/grid", 10)),
        tf_(nh_.advertise<tf2_msgs::TFMessage>("/tf", 100)) {
    // Each test lies an hour after the one before, so that none looks like time going back to the node.
    static int tests = 0;
    start_ = ros::Time(1700000000 + 3600 * tests++);
    config_.publish(toMsg(radar_));
    // Both nodes of the launch files, so that each has the configuration and tf.
    const bool connected = waitFor([this] {
      return grids_.connected() && maps_.connected() && twin_maps_.connected() && cubes_.getNumSubscribers() > 1 &&
             config_.getNumSubscribers() > 1 && tf_.getNumSubscribers() > 1 && twin_.getNumSubscribers() > 0;
    });
    if (!connected) throw std::runtime_error("the signal chain does not start");
    if (!answers(grids_, maps_, twin_maps_)) throw std::runtime_error("the signal chain does not answer");
  }

  /// Sends probes until each of the inboxes has one, and waits for the newest, with which nothing of them is on its way
  /// any more. A subscriber knows of its publisher before that one has begun to send to it, and a configuration comes
  /// another way than the frames.
  template <typename... Inboxes>
  bool answers(Inboxes&... inboxes) {
    ros::Time newest;
    const auto probe = [&] {
      newest = sendProbe();
      return waitFor([&] { return (!inboxes.messages.empty() && ...); }, 0.2);
    };
    if (!waitFor(probe) || !waitFor([&] { return (inboxes.endsWith(newest) && ...); })) return false;
    (inboxes.messages.clear(), ...);
    return true;
  }

  /// A frame and a grid of the twin of half an hour before and elsewhere; their stamp.
  ros::Time sendProbe() {
    const ros::Time at = start_ - ros::Duration(1800) + ros::Duration(probes_++);
    sendPose(at - ros::Duration(0.02), -50);
    sendPose(at + ros::Duration(0.02), -50);
    AdcCube cube = frame(0);
    cube.stamp_ns = toNanoseconds(at);
    cubes_.publish(toMsg(cube, hash_));
    twin_.publish(toMsg(twinGrid(at), hash_));
    return at;
  }

  ReceiveGrid twinGrid(const ros::Time& stamp) const {
    ReceiveGrid grid;
    grid.stamp_ns = toNanoseconds(stamp);
    grid.source = Branch::kSimulated;
    grid.full_scale = 1;
    grid.frames = 1;
    grid.x = pointTarget(radar_, 4.0, -0.4, 1e-4);
    return grid;
  }

  void sendNonsense() {
    mmradartwin_msgs::RadarConfig nonsense = toMsg(radar_);
    nonsense.slope_hz_per_s = -1;
    config_.publish(nonsense);
  }

  /// Whether the node under test has said so in its log, which alone tells what it refuses.
  bool hasSaid(const std::string& words) const {
    return std::any_of(log_.messages.begin(), log_.messages.end(), [&](const rosgraph_msgs::Log::ConstPtr& log) {
      return log->name.rfind("/corrected", 0) != 0 && log->msg.find(words) != std::string::npos;
    });
  }

  /// Waits until the log comes here: a configuration is refused aloud each time.
  bool hearsTheLog() {
    const auto refused = [this] { return hasSaid("radar/config refused"); };
    return waitFor([&] {
      sendNonsense();
      return waitFor(refused, 0.2);
    });
  }

  void sendPose(const ros::Time& stamp, double x, double yaw_deg = 0) {
    geometry_msgs::TransformStamped T;
    T.header.stamp = stamp;
    T.header.frame_id = "map";
    T.child_frame_id = "radar_link";
    T.transform.translation.x = x;
    T.transform.rotation.z = std::sin(yaw_deg * M_PI / 360);
    T.transform.rotation.w = std::cos(yaw_deg * M_PI / 360);
    broadcaster_.sendTransform(T);
  }

  /// A frame of a point target whose amplitude tells frames apart.
  AdcCube frame(int i, double azimuth_deg = 30) const {
    const ComplexGrid x = pointTarget(radar_, 3.0, azimuth_deg * M_PI / 180, 1000 + 100 * i);
    AdcCube cube;
    cube.stamp_ns = toNanoseconds(start_) + radar_.frame_offset_ns(i);
    cube.sequence = static_cast<std::uint32_t>(i);
    cube.chirps = 2, cube.samples = 64, cube.receivers = 4;
    for (int chirp = 0; chirp < 2; ++chirp) {
      for (int n = 0; n < 64; ++n) {
        for (int rx = 0; rx < 4; ++rx) {
          cube.data.push_back(static_cast<std::int16_t>(std::lround(x(4 * chirp + rx, n).real())));
          cube.data.push_back(static_cast<std::int16_t>(std::lround(x(4 * chirp + rx, n).imag())));
        }
      }
    }
    cube.chirp_valid.assign(2, 1);
    return cube;
  }

  ros::Time stamp(double frames) const { return start_ + ros::Duration(frames * 0.05); }
  void send(int i) { cubes_.publish(toMsg(frame(i), hash_)); }

  ros::NodeHandle nh_;
  RadarConfig radar_;
  std::uint64_t hash_;
  ros::Time start_;
  int probes_ = 0;
  Inbox<mmradartwin_msgs::ReceiveGrid> grids_;
  Inbox<mmradartwin_msgs::RangeAngleMap> maps_, twin_maps_;
  Inbox<rosgraph_msgs::Log> log_;
  ros::Publisher config_, cubes_, twin_, tf_;  ///< tf_ is the broadcaster's topic, to see who listens
  tf2_ros::TransformBroadcaster broadcaster_;
};

TEST_F(SignalChainNodeTest, AveragesFramesAndPutsTheirPoseIn) {
  sendPose(stamp(-0.5), 1.0, 20);
  sendPose(stamp(10), 1.0, 20);
  for (int i = 0; i < 5; ++i) send(i);
  ASSERT_TRUE(grids_.wait(5) && maps_.wait(5));
  CoherentAverage average(radar_, 3);
  const SignalChain chain(radar_);
  for (int i = 0; i < 5; ++i) {
    average.add(frame(i));
    const auto& grid = *grids_.messages[static_cast<std::size_t>(i)];
    const auto& map = *maps_.messages[static_cast<std::size_t>(i)];
    EXPECT_EQ(grid.frames, static_cast<std::uint32_t>(std::min(i + 1, 3)));
    EXPECT_EQ(grid.header.stamp, stamp(i));
    EXPECT_EQ(grid.header.frame_id, "radar_link");
    EXPECT_EQ(grid.radar_hash, hash_);
    EXPECT_TRUE(grid.pose_valid);
    EXPECT_NEAR(grid.T_map_radar.position.x, 1.0, 1e-12);
    EXPECT_NEAR(grid.T_map_radar.orientation.z, std::sin(10 * M_PI / 180), 1e-12);
    EXPECT_TRUE(fromMsg(grid).x == average.grid().x) << "frame " << i;
    const RealGrid expected = chain.map(average.grid()).power_db;
    EXPECT_TRUE(fromMsg(map).power_db == expected.cast<float>().cast<double>()) << "frame " << i;
    EXPECT_EQ(map.frames, grid.frames);
  }
  // The target stands at +30 deg, to the left.
  Eigen::Index r, a;
  fromMsg(*maps_.messages.back()).power_db.maxCoeff(&r, &a);
  EXPECT_NEAR(maps_.messages.back()->azimuth_rad[static_cast<std::size_t>(a)] * 180 / M_PI, 30, 2);
  EXPECT_NEAR(maps_.messages.back()->range_m[static_cast<std::size_t>(r)], 3.0, 0.08);
}

// The second node of the launch files has a channels.yaml.
TEST_F(SignalChainNodeTest, CorrectsTheMeasuredChannels) {
  Inbox<mmradartwin_msgs::ReceiveGrid> corrected(nh_, "corrected/radar/grid");
  ASSERT_TRUE(answers(grids_, maps_, twin_maps_, corrected));
  sendPose(stamp(-0.5), 1.0);
  sendPose(stamp(10), 1.0);
  send(0);
  ASSERT_TRUE(grids_.wait(1) && corrected.wait(1));
  const ComplexGrid raw = fromMsg(*grids_.messages[0]).x, x = fromMsg(*corrected.messages[0]).x;
  EXPECT_TRUE(raw.row(0) == x.row(0));
  const std::complex<double> f = raw(5, 9) / x(5, 9);
  EXPECT_NEAR(std::arg(f) * 180 / M_PI, -30, 1e-4);
  EXPECT_NEAR(20 * std::log10(std::abs(f)), 2, 1e-4);
}

TEST_F(SignalChainNodeTest, BeginsAnewWhenTheRadarMovesOrTurns) {
  sendPose(stamp(-0.5), 0);
  sendPose(stamp(1.5), 0);
  sendPose(stamp(1.6), 0.03);
  sendPose(stamp(3.5), 0.03);
  sendPose(stamp(3.6), 0.03, 1.5);
  sendPose(stamp(10), 0.03, 1.5);
  for (int i = 0; i < 6; ++i) send(i);
  ASSERT_TRUE(grids_.wait(6));
  std::vector<std::uint32_t> frames;
  for (const auto& grid : grids_.messages) frames.push_back(grid->frames);
  EXPECT_EQ(frames, (std::vector<std::uint32_t>{1, 2, 1, 2, 1, 2}));
}

TEST_F(SignalChainNodeTest, WaitsForThePoseAtTheStampAndGoesOnWithoutOne) {
  ASSERT_TRUE(hearsTheLog());
  sendPose(stamp(-0.5), 5);
  send(0);
  send(0);
  ASSERT_TRUE(waitFor([this] { return hasSaid("frame 0 refused: it has the stamp of the one before"); }));
  // Frame 0 has come, and its pose is only sent now.
  sendPose(stamp(0.5), 5.08);
  ASSERT_TRUE(grids_.wait(1));
  EXPECT_TRUE(grids_.messages[0]->pose_valid) << "did not wait for tf";
  EXPECT_NEAR(grids_.messages[0]->T_map_radar.position.x, 5.04, 1e-9);  // between the two, at the frame's stamp
  send(1);
  ASSERT_TRUE(grids_.wait(2));
  EXPECT_FALSE(grids_.messages[1]->pose_valid);
  EXPECT_EQ(grids_.messages[1]->T_map_radar.orientation.w, 1);
}

TEST_F(SignalChainNodeTest, LosesNoneOfTheFramesThatALatePoseLetsGo) {
  ASSERT_TRUE(hearsTheLog());
  sendPose(stamp(-0.5), 1.0);
  constexpr int kFrames = 80;
  for (int i = 0; i < kFrames; ++i) send(i);
  cubes_.publish(toMsg(frame(kFrames), hash_ ^ 1));
  ASSERT_TRUE(waitFor([this] { return hasSaid("it was taken with another radar configuration"); }));
  // All frames have come and wait.
  sendPose(stamp(kFrames), 1.0);
  ASSERT_TRUE(grids_.wait(kFrames) && maps_.wait(kFrames)) << grids_.messages.size() << " grids";
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_EQ(grids_.messages[static_cast<std::size_t>(i)]->header.stamp, stamp(i));
  }
}

TEST_F(SignalChainNodeTest, GivesNoPoseToFramesWithinAJumpOrAGapOfTf) {
  // A jump of 1 m at frame 2, 0.25 s of silence over which the radar goes 0.3 m on at frames 5 to 9, as long a silence
  // that ends where it began at frames 11 to 15.
  for (double at : {-0.5, 0.5, 1.5}) sendPose(stamp(at), 1.0);
  for (double at : {2.5, 3.5, 4.5}) sendPose(stamp(at), 2.0);
  for (double at : {9.5, 10.5, 15.5, 16.5}) sendPose(stamp(at), 2.3);
  const std::vector<int> sent = {0, 1, 2, 3, 4, 5, 7, 9, 10, 11, 14, 16};
  for (int i : sent) send(i);
  ASSERT_TRUE(grids_.wait(sent.size()));
  std::vector<std::string> got;
  for (const auto& grid : grids_.messages) {
    got.push_back(grid->pose_valid ? std::to_string(grid->T_map_radar.position.x).substr(0, 3) : "-");
    got.back() += " " + std::to_string(grid->frames);
  }
  EXPECT_EQ(got, (std::vector<std::string>{"1.0 1", "1.0 2", "- 1", "2.0 1", "2.0 2", "- 1", "- 2", "- 3", "2.3 1",
                                           "2.3 2", "2.3 3", "2.3 3"}));
}

TEST_F(SignalChainNodeTest, SurvivesBadMessagesAndForeignRadars) {
  sendPose(stamp(-0.5), 0);
  sendPose(stamp(10), 0);
  cubes_.publish(toMsg(frame(0), hash_ ^ 1));
  mmradartwin_msgs::AdcCube broken = toMsg(frame(1), hash_);
  broken.samples.resize(7);
  cubes_.publish(broken);
  ASSERT_TRUE(hearsTheLog());
  mmradartwin_msgs::ReceiveGrid grid;
  grid.channels = 3;
  twin_.publish(grid);
  twin_.publish(toMsg(twinGrid(stamp(0)), hash_));
  ASSERT_TRUE(twin_maps_.wait(1));
  EXPECT_EQ(twin_maps_.messages[0]->header.stamp, stamp(0));
  send(2);
  ASSERT_TRUE(grids_.wait(1));
  EXPECT_EQ(grids_.messages[0]->header.stamp, stamp(2));
  EXPECT_EQ(grids_.messages[0]->frames, 1u);
}

TEST_F(SignalChainNodeTest, BeginsAnewWhenStampsGoBack) {
  sendPose(stamp(-0.5), 0);
  sendPose(stamp(10), 0);
  for (int i = 3; i < 6; ++i) send(i);
  ASSERT_TRUE(grids_.wait(3));
  EXPECT_EQ(grids_.messages[2]->frames, 3u);
  send(0);
  sendPose(stamp(-0.5), 0);
  sendPose(stamp(2), 0);
  ASSERT_TRUE(grids_.wait(4));
  EXPECT_EQ(grids_.messages[3]->frames, 1u);
  EXPECT_EQ(grids_.messages[3]->header.stamp, stamp(0));
}

TEST_F(SignalChainNodeTest, TwinGridsGoThroughTheSameChain) {
  const ReceiveGrid grid = twinGrid(stamp(0));
  twin_.publish(toMsg(grid, hash_));
  ASSERT_TRUE(twin_maps_.wait(1));
  const RangeAngleMap map = fromMsg(*twin_maps_.messages[0]);
  EXPECT_TRUE(map.source == Branch::kSimulated);
  EXPECT_TRUE(map.power_db == SignalChain(radar_).map(grid).power_db.cast<float>().cast<double>());
  EXPECT_EQ(map.stamp_ns, grid.stamp_ns);
  EXPECT_EQ(map.axes.azimuth_rad, SignalChain(radar_).axes().azimuth_rad);
}

TEST_F(SignalChainNodeTest, LeavesTransformsOfTheFutureOutAndSaysWhoseTheyAre) {
  ASSERT_TRUE(hearsTheLog());
  const auto ahead = [this] {
    sendPose(ros::Time::now() + ros::Duration(3600), 7.0);
    return waitFor([this] { return hasSaid("ahead of this computer's clock"); }, 0.2);
  };
  ASSERT_TRUE(waitFor(ahead));
  EXPECT_TRUE(hasSaid("of " + ros::this_node::getName() + " is left out"));
  sendPose(stamp(-0.5), 1.0);
  sendPose(stamp(10), 1.0);
  send(0);
  ASSERT_TRUE(grids_.wait(1));
  EXPECT_TRUE(grids_.messages[0]->pose_valid);
  EXPECT_NEAR(grids_.messages[0]->T_map_radar.position.x, 1.0, 1e-12);
}

TEST_F(SignalChainNodeTest, RefusesStampsThatNoClockHasAndGoesOn) {
  sendPose(stamp(-0.5), 1.0);
  sendPose(stamp(10), 1.0);
  mmradartwin_msgs::AdcCube cube = toMsg(frame(0), hash_);
  cube.header.frame_id = "radar_link";
  for (const std::uint32_t seconds : {4000000000u, 4294967295u}) {
    cube.header.stamp = ros::Time(seconds, 0);
    cubes_.publish(cube);
  }
  send(0);
  ASSERT_TRUE(grids_.wait(1));
  EXPECT_EQ(grids_.messages[0]->header.stamp, stamp(0));
}

TEST_F(SignalChainNodeTest, SaysWhereTransformsContradictEachOther) {
  ASSERT_TRUE(hearsTheLog());
  // In turn, as two publishers say it; again and again, since what is sent before a subscriber is connected is lost.
  double x = 0;
  const auto contradict = [&] {
    for (const char* parent : {"map", "odom"}) {
      geometry_msgs::TransformStamped T;
      T.header.stamp = stamp(x += 0.1);
      T.header.frame_id = parent;
      T.child_frame_id = "trolley";
      T.transform.rotation.w = 1;
      broadcaster_.sendTransform(T);
    }
    return waitFor([this] { return hasSaid("frame trolley has 2 parents"); }, 0.2);
  };
  EXPECT_TRUE(waitFor(contradict));
  EXPECT_TRUE(hasSaid("published by " + ros::this_node::getName()));
}

}  // namespace
}  // namespace mmradartwin

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "signal_chain_node_test");
  const ros::NodeHandle nh;
  const int result = RUN_ALL_TESTS();
  // A nodelet manager may abort at shutdown while nodelets are loaded.
  std::string nodelet;
  if (ros::NodeHandle("~").getParam("unload", nodelet)) {
    nodelet::NodeletUnload unload;
    unload.request.name = nodelet;
    ros::service::call("manager/unload_nodelet", unload);
  }
  return result;
}
