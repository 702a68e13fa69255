#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <mmradartwin_msgs/AdcCube.h>
#include <mmradartwin_msgs/RadarConfig.h>
#include <mmradartwin_msgs/ReceiveGrid.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "mmradartwin_dsp/cfar.h"
#include "mmradartwin_dsp/channel_correction.h"
#include "mmradartwin_dsp/coherent_average.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/ros/frame_publisher.h"
#include "mmradartwin_dsp/ros/future_transforms.h"
#include "mmradartwin_dsp/ros/map_publisher.h"
#include "mmradartwin_dsp/ros/node_program.h"
#include "mmradartwin_dsp/ros/topic_watch.h"
#include "mmradartwin_dsp/ros/transform_record.h"
#include "mmradartwin_dsp/ros/transform_sources.h"

namespace mmradartwin {

/// radar/config, radar/adc, twin/grid -> radar/grid, radar/range_angle, radar/range_doppler, radar/points,
/// twin/range_angle. The same class runs as a node and as a nodelet; callbacks must come one at a time.
///
/// A frame waits until tf knows T_map_radar at its stamp, `pose_timeout_s` at most; without a pose it goes on with
/// pose_valid = false. So does a frame within a jump of tf, or within more than `tf_gap_s` without transforms at whose
/// ends the radar stands elsewhere: what tf interpolates there is no place where it was. Frames with and without a pose
/// are not averaged with each other. The average begins anew when the radar has moved by more than `moved_m` or
/// `moved_deg` since the window's first pose, when radar/config changes, and when stamps go back (a bag that loops).
/// Frames of another radar configuration than the latched one are refused. With `channels`, a channels.yaml, grids and
/// maps of the measured branch are corrected by it; a radar/config that it does not fit is refused.
class SignalChainNode {
 public:
  /// Throws InputError for unknown or unusable parameters.
  SignalChainNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh);
  static NodeDescription description();

 private:
  struct Settings {
    explicit Settings(StrictParameters& parameters);

    int average_frames, publish_every;
    double moved_m, moved_rad, pose_timeout_s;
    TransformLimits tf_limits;
    CfarSettings cfar;
    std::string map_frame, radar_frame, channels_file;
  };

  struct Waiting {
    mmradartwin_msgs::AdcCube::ConstPtr cube;
    ros::Time since;
  };

  void onConfig(const mmradartwin_msgs::RadarConfig::ConstPtr& config);
  void onCube(const mmradartwin_msgs::AdcCube::ConstPtr& cube);
  void forgetTransforms();
  void onTransforms(const tf2_msgs::TFMessage& message, bool fixed, const std::string& publisher);
  void onTwinGrid(const mmradartwin_msgs::ReceiveGrid::ConstPtr& grid);
  /// In words; `said` is tf2's own.
  std::string whyNoPose(const ros::Time& stamp, const std::string& said) const;
  /// Takes all frames from the queue whose pose is known or will not come.
  void drain();
  void process(const mmradartwin_msgs::AdcCube& cube, const std::optional<Eigen::Isometry3d>& T_map_radar);
  void publish(const AdcCube& cube, const std::optional<Eigen::Isometry3d>& T_map_radar);
  void restart();
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const;

  const Settings settings_;
  tf2_ros::Buffer tf_buffer_;
  TransformRecord tf_record_;
  TransformSources tf_sources_;
  FutureTransforms future_transforms_;
  ros::Time tf_heard_, newest_transform_;
  ros::Publisher grid_publisher_;
  MapPublisher<mmradartwin_msgs::RangeAngleMap> map_publisher_, twin_map_publisher_;
  std::unique_ptr<FramePublisher> frame_publisher_;
  ros::Subscriber config_subscriber_, cube_subscriber_, twin_subscriber_, tf_subscriber_, tf_static_subscriber_;
  ros::WallTimer timer_;

  std::uint64_t radar_hash_ = 0;
  std::optional<SignalChain> chain_;
  std::optional<CoherentAverage> average_;
  std::optional<ChannelCorrection> channels_;
  std::optional<Eigen::Isometry3d> window_pose_;  ///< first known pose of the window
  std::deque<Waiting> queue_;
  ros::Time newest_;
  int since_published_ = 0;

  TopicWatch cubes_{"the driver (or the bag's player)"};
  std::uint64_t frames_ = 0, without_pose_ = 0, refused_ = 0;
  std::string no_pose_;  ///< why the last frame had none; "" where it had one
  std::unique_ptr<diagnostic_updater::Updater> updater_;
  ros::WallTimer diagnostics_timer_;
};

}  // namespace mmradartwin
