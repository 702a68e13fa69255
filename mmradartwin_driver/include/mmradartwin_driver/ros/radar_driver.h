#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <memory>
#include <string>

#include "mmradartwin_driver/pose_watch.h"
#include "mmradartwin_driver/rig.h"

namespace mmradartwin {

/// The rig as a node: publishes `radar/config` (latched), `radar/adc` (one message per frame) and diagnostics: "radar
/// stream" (rate, loss, drops of this host), "capture card" (status, version), "radar device" (events, temperature)
/// and "radar pose" (age, gaps and jumps of tf).
/// Private parameters: radar (path of radar.yaml, required), host_ip, card_ip, config_port, data_port, packet_delay_us,
/// configure_card, configure_radar (bring the radar up over USB; radar/config then says the values as the chip rounds
/// them), radar_firmware (image for an empty flash), record_pcap (a pcap file to record all packets to), frame_id,
/// map_frame (empty: poses are not watched), pose_age_limit_s.
class RadarDriver {
 public:
  /// Throws InputError for unusable parameters. Problems of the rig are reported, and the rig tries again.
  RadarDriver(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);
  ~RadarDriver();

 private:
  void publish(AdcCube&& cube);
  void readParameters(const ros::NodeHandle& private_nh);
  void observePose();
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status);
  void diagnoseCard(diagnostic_updater::DiagnosticStatusWrapper& status);
  void diagnoseDevice(diagnostic_updater::DiagnosticStatusWrapper& status);
  void diagnosePose(diagnostic_updater::DiagnosticStatusWrapper& status);

  RadarConfig radar_;
  std::uint64_t radar_hash_ = 0;
  std::string frame_id_, map_frame_;
  RigOptions options_;
  ros::Publisher config_publisher_, adc_publisher_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_, pose_timer_;
  PoseWatch pose_watch_;
  std::unique_ptr<tf2_ros::Buffer> tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  FrameAssembler::Counters diagnosed_frames_;
  PacketReceiver::Counters diagnosed_packets_;
  std::uint64_t diagnosed_not_taken_ = 0;
  ros::WallTime diagnosed_at_;
  std::unique_ptr<Rig> rig_;  ///< last member: its thread uses the others
};

}  // namespace mmradartwin
