#include "mmradartwin_dsp/ros/signal_chain_node.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/point_cloud.h"
#include "mmradartwin_dsp/ros/tf_warning_count.h"
#include "mmradartwin_dsp/stationary_poses.h"

namespace mmradartwin {
namespace {

constexpr double kWarnEvery_s = 5;
/// Beyond it a frame's stamp and those of tf are of different clocks.
constexpr double kClocksApart_s = 5;
/// Frames that may wait for tf; a second at the fastest frame rates.
constexpr std::size_t kLongestQueue = 1000;

}  // namespace

SignalChainNode::SignalChainNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh)
    : settings_(readSettings<Settings>(private_nh)) {
  if (!settings_.channels_file.empty()) channels_ = loadChannelCorrection(settings_.channels_file);
  countTfWarningsOfProcess();
  // A pose that comes late lets all frames go that waited for it; the answers to none of them may be pushed out.
  grid_publisher_ = nh.advertise<mmradartwin_msgs::ReceiveGrid>("radar/grid", kLongestQueue);
  map_publisher_ = {nh, "radar/range_angle", kLongestQueue};
  twin_map_publisher_ = {nh, "twin/range_angle", kLongestQueue};
  frame_publisher_ = std::make_unique<FramePublisher>(nh, settings_.cfar);
  config_subscriber_ = nh.subscribe("radar/config", 2, &SignalChainNode::onConfig, this);
  cube_subscriber_ = nh.subscribe("radar/adc", 200, &SignalChainNode::onCube, this);
  twin_subscriber_ = nh.subscribe("twin/grid", 50, &SignalChainNode::onTwinGrid, this);
  // Not tf2_ros::TransformListener: buffer and record have to know the same transforms at any time.
  using Transforms = ros::MessageEvent<tf2_msgs::TFMessage const>;
  const auto onEvent = [this](bool fixed) -> boost::function<void(const Transforms&)> {
    return [this, fixed](const Transforms& event) {
      onTransforms(*event.getConstMessage(), fixed, event.getPublisherName());
    };
  };
  tf_subscriber_ = nh.subscribe<tf2_msgs::TFMessage>("/tf", 100, onEvent(false));
  tf_static_subscriber_ = nh.subscribe<tf2_msgs::TFMessage>("/tf_static", 100, onEvent(true));
  timer_ = nh.createWallTimer(ros::WallDuration(0.01), [this](const ros::WallTimerEvent&) { drain(); });
  updater_ = std::make_unique<diagnostic_updater::Updater>(nh, private_nh, ros::this_node::getName());
  updater_->setHardwareID("none");
  updater_->add("signal chain", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { diagnose(status); });
  diagnostics_timer_ = nh.createWallTimer(ros::WallDuration(kDiagnosticsEvery_s),
                                          [this](const ros::WallTimerEvent&) { updater_->force_update(); });
}

SignalChainNode::Settings::Settings(StrictParameters& parameters) {
  average_frames = parameters.integer("average_frames", 100, 1, 1000000, "frames of the sliding coherent average");
  publish_every = parameters.integer("publish_every", 1, 1, 1000000, "so many frames for one grid and one map");
  moved_m =
      parameters.number("moved_m", 0.02, 1e-4, 1e3, "the average begins anew where the radar has moved by more, m");
  moved_rad = parameters.number("moved_deg", 1.0, 1e-2, 180,
                                "the average begins anew where the radar has turned by more, deg") *
              M_PI / 180;
  pose_timeout_s = parameters.number("pose_timeout_s", 0.5, 0, 60, "a frame waits so long for its pose in tf, s");
  tf_limits.gap_s =
      parameters.number("tf_gap_s", tf_limits.gap_s, 0, 60,
                        "in a longer gap of tf, at whose ends the radar stands elsewhere, frames have no pose, s");
  map_frame = parameters.text("map_frame", "map", "tf frame of the scene");
  radar_frame = parameters.text("radar_frame", kRadarFrame, "tf frame of the radar");
  channels_file = parameters.existingPath(
      "channels", "channels.yaml of calibrate, by which the measured branch is corrected; empty: none");
  cfar = readCfarSettings(parameters);
  parameters.ofDiagnosticUpdater();
}

NodeDescription SignalChainNode::description() {
  return {
      "dsp_node",
      "signal_chain",
      "Makes a grid of channels and a range-angle map of each frame, averaged coherently while the radar stands, and a "
      "map of each simulated grid. Of frames with eight loops or more it tells radial speeds, too.",
      {topic<mmradartwin_msgs::RadarConfig>("radar/config", "the radar; latched"),
       topic<mmradartwin_msgs::AdcCube>("radar/adc", "raw samples, a message per frame"),
       topic<mmradartwin_msgs::ReceiveGrid>("twin/grid", "what the twin receives"),
       topic<tf2_msgs::TFMessage>("/tf", "where the radar is in the scene"),
       topic<tf2_msgs::TFMessage>("/tf_static", "the same of what does not move")},
      {topic<mmradartwin_msgs::ReceiveGrid>("radar/grid", "averaged channels, with the radar's pose where it is known"),
       topic<mmradartwin_msgs::RangeAngleMap>("radar/range_angle", "map of radar/grid"),
       topic<sensor_msgs::Image>("radar/range_angle/image", "the same as a picture: dBFS, a row per range bin"),
       topic<mmradartwin_msgs::RangeDopplerMap>("radar/range_doppler", "levels by range and radial speed, of a frame"),
       topic<sensor_msgs::Image>("radar/range_doppler/image", "the same as a picture: dBFS, a row per range bin"),
       topic<sensor_msgs::PointCloud2>("radar/points", "what CFAR detects in map and frame"),
       topic<mmradartwin_msgs::RangeAngleMap>("twin/range_angle", "map of twin/grid"),
       topic<sensor_msgs::Image>("twin/range_angle/image", "the same as a picture: dBFS, a row per range bin"),
       topic<diagnostic_msgs::DiagnosticArray>("/diagnostics", "whether frames and poses come, and why not")},
      {},
      [](StrictParameters& parameters) { const Settings settings(parameters); }};
}

void SignalChainNode::onConfig(const mmradartwin_msgs::RadarConfig::ConstPtr& config) {
  const std::uint64_t hash = radarHash(*config);
  if (chain_ && hash == radar_hash_) return;
  try {
    const RadarConfig radar = fromMsg(*config);
    SignalChain chain(radar);
    if (channels_) requireChannelsOf(radar, *channels_);
    chain_.emplace(std::move(chain));
    average_.emplace(radar, settings_.average_frames);
    frame_publisher_->setRadar(radar);
    radar_hash_ = hash;
    restart();
  } catch (const std::exception& error) {
    ROS_ERROR("radar/config refused: %s", error.what());
  }
}

void SignalChainNode::restart() {
  if (average_) average_->reset();
  window_pose_.reset();
  queue_.clear();
  newest_ = ros::Time();
  since_published_ = 0;
}

void SignalChainNode::onCube(const mmradartwin_msgs::AdcCube::ConstPtr& cube) {
  cubes_.heard();
  if (!average_) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "frames come, but no radar/config: they are left out until it does");
    return;
  }
  if (!usableStamp(cube->header.stamp)) {
    ++refused_;
    ROS_WARN_THROTTLE(kWarnEvery_s, "frame %u refused: its stamp, %u s, is no time", cube->sequence,
                      cube->header.stamp.sec);
    return;
  }
  if (cube->radar_hash != radar_hash_) {
    ++refused_;
    ROS_WARN_THROTTLE(
        kWarnEvery_s,
        "frame %u refused: it was taken with another radar configuration (%016lx) than radar/config's (%016lx)",
        cube->sequence, static_cast<unsigned long>(cube->radar_hash), static_cast<unsigned long>(radar_hash_));
    return;
  }
  if (!newest_.isZero() && cube->header.stamp == newest_) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "frame %u refused: it has the stamp of the one before", cube->sequence);
    return;
  }
  if (cube->header.stamp < newest_) {
    ROS_INFO("stamps went back by %.3f s: the average begins anew", (newest_ - cube->header.stamp).toSec());
    restart();
    // What tf holds lies in the future now and would keep older transforms out. With simulated time onTransforms() has
    // seen the jump itself, and has begun to fill again.
    if (!ros::Time::isSimTime()) forgetTransforms();
  }
  newest_ = cube->header.stamp;
  queue_.push_back({cube, ros::Time::now()});
  drain();
}

void SignalChainNode::forgetTransforms() {
  tf_buffer_.clear();
  tf_record_.clearMoving();
}

void SignalChainNode::onTransforms(const tf2_msgs::TFMessage& message, bool fixed, const std::string& publisher) {
  const ros::Time now = ros::Time::now();
  if (now < tf_heard_) forgetTransforms();
  tf_heard_ = now;
  const tf2_msgs::TFMessage kept = future_transforms_.leaveOut(message, fixed, publisher, newest_);
  for (const geometry_msgs::TransformStamped& transform : kept.transforms) {
    if (!fixed) newest_transform_ = transform.header.stamp;
    tf_buffer_.setTransform(transform, publisher, fixed);  // says itself what is wrong with one that it does not take
  }
  tf_record_.add(kept, fixed);
  tf_record_.keep(tf_buffer_.getCacheLength().toSec());
  for (const std::string& contradiction : tf_sources_.add(kept, fixed, publisher)) {
    ROS_WARN("tf contradicts itself: %s", contradiction.c_str());
  }
}

void SignalChainNode::drain() {
  while (!queue_.empty()) {
    const Waiting& front = queue_.front();
    const ros::Time stamp = front.cube->header.stamp;
    std::optional<Eigen::Isometry3d> T_map_radar;
    try {
      const geometry_msgs::Transform T =
          tf_buffer_.lookupTransform(settings_.map_frame, settings_.radar_frame, stamp).transform;
      const std::string why = tf_record_.whyNotBetween(toNanoseconds(stamp), settings_.map_frame, settings_.radar_frame,
                                                       settings_.tf_limits);
      if (why.empty()) {
        T_map_radar = fromMsg(T);
      } else {
        no_pose_ = why;
        ROS_WARN_THROTTLE(kWarnEvery_s, "frame at %.6f goes on without a pose: %s", stamp.toSec(), why.c_str());
      }
    } catch (const std::exception& error) {  // of tf2, and of ros::Duration that cannot hold a difference
      const double waited_s = (ros::Time::now() - front.since).toSec();
      // Time that went back while the frame waited counts as waited out.
      if (waited_s >= 0 && waited_s < settings_.pose_timeout_s && queue_.size() < kLongestQueue) return;
      no_pose_ = whyNoPose(stamp, error.what());
      ROS_WARN_THROTTLE(kWarnEvery_s, "frame at %.6f goes on without a pose: %s", stamp.toSec(), no_pose_.c_str());
    }
    const mmradartwin_msgs::AdcCube::ConstPtr cube = front.cube;
    queue_.pop_front();
    ++frames_;
    if (T_map_radar) {
      no_pose_.clear();
    } else {
      ++without_pose_;
    }
    process(*cube, T_map_radar);
  }
}

std::string SignalChainNode::whyNoPose(const ros::Time& stamp, const std::string& said) const {
  if (stamp.isZero()) return "its stamp is zero, the driver did not stamp it";
  const double later_s = (stamp - newest_transform_).toSec();
  if (newest_transform_.isZero() || std::abs(later_s) < kClocksApart_s) return said;
  char text[160];
  std::snprintf(text, sizeof text,
                "it is stamped %.1f s %s than the newest transform; where tf goes on, clocks of two computers differ: "
                "synchronise them (ntp, chrony)",
                std::abs(later_s), later_s > 0 ? "later" : "earlier");
  return text;
}

void SignalChainNode::process(const mmradartwin_msgs::AdcCube& msg,
                              const std::optional<Eigen::Isometry3d>& T_map_radar) {
  try {
    const AdcCube cube = fromMsg(msg);
    const bool moved = T_map_radar && window_pose_ &&
                       !standsStill(*T_map_radar, *window_pose_, settings_.moved_m, settings_.moved_rad);
    if (moved || T_map_radar.has_value() != window_pose_.has_value()) {
      average_->reset();
      window_pose_.reset();
    }
    if (T_map_radar && !window_pose_) window_pose_ = T_map_radar;
    average_->add(cube);
    if (++since_published_ < settings_.publish_every) return;
    since_published_ = 0;
    if (!average_->complete()) {
      ROS_WARN_THROTTLE(kWarnEvery_s, "no map: a TDM slot has no valid chirp in the last %d frame(s)",
                        average_->frames());
      return;
    }
    publish(cube, T_map_radar);
  } catch (const std::exception& error) {
    ++refused_;
    ROS_WARN_THROTTLE(kWarnEvery_s, "frame refused: %s", error.what());
  }
}

void SignalChainNode::publish(const AdcCube& cube, const std::optional<Eigen::Isometry3d>& T_map_radar) {
  ReceiveGrid grid = average_->grid();
  if (channels_) correctChannels(*channels_, grid.x);
  grid.pose_valid = T_map_radar.has_value();
  if (T_map_radar) grid.T_map_radar = *T_map_radar;
  if (grid_publisher_.getNumSubscribers() > 0) {
    const auto msg = boost::make_shared<mmradartwin_msgs::ReceiveGrid>(toMsg(grid, radar_hash_));
    msg->header.frame_id = settings_.radar_frame;
    grid_publisher_.publish(msg);
  }
  if (!map_publisher_.isWanted() && !frame_publisher_->isWanted()) return;
  const auto map = boost::make_shared<mmradartwin_msgs::RangeAngleMap>(toMsg(chain_->map(grid), radar_hash_));
  map->header.frame_id = settings_.radar_frame;
  map_publisher_.publish(map);
  frame_publisher_->publish(*chain_, cube, channels_ ? &*channels_ : nullptr, *map);
}

void SignalChainNode::onTwinGrid(const mmradartwin_msgs::ReceiveGrid::ConstPtr& msg) {
  if (!chain_) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "twin/grid comes, but no radar/config: it is left out until it does");
    return;
  }
  if (!twin_map_publisher_.isWanted()) return;
  if (msg->radar_hash != radar_hash_) {
    // A twin may model another radar than the one that measures; both are drawn on the measured one's axes.
    ROS_WARN_THROTTLE(
        60, "twin/grid was made for another radar configuration than radar/config's; its map has the measured axes");
  }
  try {
    const auto map =
        boost::make_shared<mmradartwin_msgs::RangeAngleMap>(toMsg(chain_->map(fromMsg(*msg)), msg->radar_hash));
    map->header.frame_id = settings_.radar_frame;
    twin_map_publisher_.publish(map);
  } catch (const std::exception& error) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "twin/grid refused: %s", error.what());
  }
}

void SignalChainNode::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const {
  using Level = diagnostic_msgs::DiagnosticStatus;
  const std::string silence = cubes_.silence(cube_subscriber_);
  if (!silence.empty()) {
    status.summary(Level::ERROR, silence);
  } else if (!chain_) {
    status.summary(Level::ERROR, "no " + config_subscriber_.getTopic() + ": look at the driver (or the bag's player)");
  } else if (!no_pose_.empty()) {
    status.summary(Level::WARN, "frames have no pose: " + no_pose_);
  } else {
    status.summary(Level::OK, "making maps");
  }
  status.add("frames", frames_);
  status.add("frames without a pose", without_pose_);
  status.add("frames refused", refused_);
  status.add("frames that wait for tf", queue_.size());
  if (chain_)
    status.add("radial speeds", frame_publisher_->whyNoSpeeds().empty() ? "told" : frame_publisher_->whyNoSpeeds());
  status.add("transforms of the future left out", future_transforms_.count());
}

}  // namespace mmradartwin
