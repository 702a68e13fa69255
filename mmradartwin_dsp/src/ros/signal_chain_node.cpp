#include "mmradartwin_dsp/ros/signal_chain_node.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/strict_parameters.h"
#include "mmradartwin_dsp/ros/tf_warning_count.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/stationary_poses.h"

namespace mmradartwin {
namespace {

constexpr double kWarnEvery_s = 5;
/// Beyond it a frame's stamp and those of tf are of different clocks.
constexpr double kClocksApart_s = 5;
/// Frames that may wait for tf; a second at the fastest frame rates.
constexpr std::size_t kLongestQueue = 1000;

}  // namespace

SignalChainNode::SignalChainNode(ros::NodeHandle nh, ros::NodeHandle private_nh) {
  readParameters(private_nh);
  countTfWarningsOfProcess();
  // A pose that comes late lets all frames go that waited for it; the answers to none of them may be pushed out.
  grid_publisher_ = nh.advertise<mmradartwin_msgs::ReceiveGrid>("radar/grid", kLongestQueue);
  map_publisher_ = nh.advertise<mmradartwin_msgs::RangeAngleMap>("radar/range_angle", kLongestQueue);
  twin_map_publisher_ = nh.advertise<mmradartwin_msgs::RangeAngleMap>("twin/range_angle", kLongestQueue);
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
}

void SignalChainNode::readParameters(const ros::NodeHandle& private_nh) {
  StrictParameters parameters(private_nh);
  average_frames_ = parameters.integer("average_frames", average_frames_, 1, 1000000);
  publish_every_ = parameters.integer("publish_every", publish_every_, 1, 1000000);
  moved_m_ = parameters.number("moved_m", moved_m_, 1e-4, 1e3);
  moved_rad_ = parameters.number("moved_deg", 1.0, 1e-2, 180) * M_PI / 180;
  pose_timeout_s_ = parameters.number("pose_timeout_s", pose_timeout_s_, 0, 60);
  tf_limits_.gap_s = parameters.number("tf_gap_s", tf_limits_.gap_s, 0, 60);
  map_frame_ = parameters.text("map_frame", map_frame_);
  radar_frame_ = parameters.text("radar_frame", radar_frame_);
  const std::string channels = parameters.text("channels", "");
  if (!channels.empty()) channels_ = loadChannelCorrection(resolvePath(channels, "/"));
  parameters.rejectUnknown();
}

void SignalChainNode::onConfig(const mmradartwin_msgs::RadarConfig::ConstPtr& config) {
  const std::uint64_t hash = radarHash(*config);
  if (chain_ && hash == radar_hash_) return;
  try {
    const RadarConfig radar = fromMsg(*config);
    SignalChain chain(radar);
    if (channels_) requireChannelsOf(radar, *channels_);
    chain_.emplace(std::move(chain));
    average_.emplace(radar, average_frames_);
    radar_hash_ = hash;
    restart();
  } catch (const InputError& error) {
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
  if (!average_) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "frames come, but no radar/config: they are left out until it does");
    return;
  }
  if (cube->radar_hash != radar_hash_) {
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
  tf_record_.add(message, fixed);
  tf_record_.keep(tf_buffer_.getCacheLength().toSec());
  for (const geometry_msgs::TransformStamped& transform : message.transforms) {
    if (!fixed) newest_transform_ = transform.header.stamp;
    tf_buffer_.setTransform(transform, publisher, fixed);  // says itself what is wrong with one that it does not take
  }
  for (const std::string& contradiction : tf_sources_.add(message, fixed, publisher)) {
    ROS_WARN("tf contradicts itself: %s", contradiction.c_str());
  }
}

void SignalChainNode::drain() {
  while (!queue_.empty()) {
    const Waiting& front = queue_.front();
    const ros::Time stamp = front.cube->header.stamp;
    std::optional<Eigen::Isometry3d> T_map_radar;
    try {
      const geometry_msgs::Transform T = tf_buffer_.lookupTransform(map_frame_, radar_frame_, stamp).transform;
      const std::string why = tf_record_.whyNotBetween(toNanoseconds(stamp), map_frame_, radar_frame_, tf_limits_);
      if (why.empty()) {
        T_map_radar = fromMsg(T);
      } else {
        ROS_WARN_THROTTLE(kWarnEvery_s, "frame at %.6f goes on without a pose: %s", stamp.toSec(), why.c_str());
      }
    } catch (const tf2::TransformException& error) {
      const double waited_s = (ros::Time::now() - front.since).toSec();
      // Time that went back while the frame waited counts as waited out.
      if (waited_s >= 0 && waited_s < pose_timeout_s_ && queue_.size() < kLongestQueue) return;
      ROS_WARN_THROTTLE(kWarnEvery_s, "frame at %.6f goes on without a pose: %s", stamp.toSec(),
                        whyNoPose(stamp, error.what()).c_str());
    }
    const mmradartwin_msgs::AdcCube::ConstPtr cube = front.cube;
    queue_.pop_front();
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
    const bool moved = T_map_radar && window_pose_ && !standsStill(*T_map_radar, *window_pose_, moved_m_, moved_rad_);
    if (moved || T_map_radar.has_value() != window_pose_.has_value()) {
      average_->reset();
      window_pose_.reset();
    }
    if (T_map_radar && !window_pose_) window_pose_ = T_map_radar;
    average_->add(cube);
    if (++since_published_ < publish_every_) return;
    since_published_ = 0;
    if (!average_->complete()) {
      ROS_WARN_THROTTLE(kWarnEvery_s, "no map: a TDM slot has no valid chirp in the last %d frame(s)",
                        average_->frames());
      return;
    }
    publish(T_map_radar);
  } catch (const InputError& error) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "frame refused: %s", error.what());
  }
}

void SignalChainNode::publish(const std::optional<Eigen::Isometry3d>& T_map_radar) {
  ReceiveGrid grid = average_->grid();
  if (channels_) correctChannels(*channels_, grid.x);
  grid.pose_valid = T_map_radar.has_value();
  if (T_map_radar) grid.T_map_radar = *T_map_radar;
  if (grid_publisher_.getNumSubscribers() > 0) {
    const auto msg = boost::make_shared<mmradartwin_msgs::ReceiveGrid>(toMsg(grid, radar_hash_));
    msg->header.frame_id = radar_frame_;
    grid_publisher_.publish(msg);
  }
  if (map_publisher_.getNumSubscribers() > 0) {
    const auto msg = boost::make_shared<mmradartwin_msgs::RangeAngleMap>(toMsg(chain_->map(grid), radar_hash_));
    msg->header.frame_id = radar_frame_;
    map_publisher_.publish(msg);
  }
}

void SignalChainNode::onTwinGrid(const mmradartwin_msgs::ReceiveGrid::ConstPtr& msg) {
  if (!chain_) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "twin/grid comes, but no radar/config: it is left out until it does");
    return;
  }
  if (twin_map_publisher_.getNumSubscribers() == 0) return;
  if (msg->radar_hash != radar_hash_) {
    // A twin may model another radar than the one that measures; both are drawn on the measured one's axes.
    ROS_WARN_THROTTLE(
        60, "twin/grid was made for another radar configuration than radar/config's; its map has the measured axes");
  }
  try {
    const auto map =
        boost::make_shared<mmradartwin_msgs::RangeAngleMap>(toMsg(chain_->map(fromMsg(*msg)), msg->radar_hash));
    map->header.frame_id = radar_frame_;
    twin_map_publisher_.publish(map);
  } catch (const InputError& error) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "twin/grid refused: %s", error.what());
  }
}

}  // namespace mmradartwin
