#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>

#include <memory>
#include <string>

#include "mmradartwin_driver/pose_watch.h"
#include "mmradartwin_driver/rig.h"
#include "mmradartwin_dsp/ros/node_program.h"
#include "mmradartwin_dsp/ros/transform_reader.h"

namespace mmradartwin {

/// The rig as a node: publishes `radar/config` (latched), `radar/adc` (one message per frame) and diagnostics: "radar
/// stream" (rate, loss, drops of this host), "capture card" (status, version), "radar device" (events, temperature)
/// and "radar pose" (age, gaps and jumps of tf).
/// With `configure_radar` radar/config says the values as the chip rounds them.
class RadarDriver {
 public:
  /// Throws InputError for unusable parameters. Problems of the rig are reported, and the rig tries again.
  RadarDriver(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);
  ~RadarDriver();
  static NodeDescription description();

 private:
  struct Settings {
    explicit Settings(StrictParameters& parameters);

    RigOptions rig;
    PoseWatch::Options pose;
    std::string radar_file, frame_id, map_frame;
    bool configure_radar;
  };

  void publish(AdcCube&& cube);
  /// radar_ and options_ of the settings.
  void loadRadar();
  void observePose();
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status);
  void diagnoseCard(diagnostic_updater::DiagnosticStatusWrapper& status);
  void diagnoseDevice(diagnostic_updater::DiagnosticStatusWrapper& status);
  void diagnosePose(diagnostic_updater::DiagnosticStatusWrapper& status);

  const Settings settings_;
  RadarConfig radar_;
  std::uint64_t radar_hash_ = 0;
  RigOptions options_;
  ros::Publisher config_publisher_, adc_publisher_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_, pose_timer_;
  PoseWatch pose_watch_;
  std::unique_ptr<tf2_ros::Buffer> tf_buffer_;
  std::unique_ptr<TransformReader> tf_reader_;
  FrameAssembler::Counters diagnosed_frames_;
  PacketReceiver::Counters diagnosed_packets_;
  std::uint64_t diagnosed_not_taken_ = 0;
  ros::WallTime diagnosed_at_;
  std::unique_ptr<Rig> rig_;  ///< last member: its thread uses the others
};

}  // namespace mmradartwin
