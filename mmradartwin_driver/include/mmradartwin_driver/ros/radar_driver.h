#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/ros.h>

#include <memory>
#include <string>

#include "mmradartwin_driver/rig.h"

namespace mmradartwin {

/// The rig as a node: publishes `radar/config` (latched), `radar/adc` (one message per frame) and diagnostics.
/// Private parameters: radar (path of radar.yaml, required), host_ip, card_ip, config_port, data_port, packet_delay_us,
/// configure_card, record_pcap (a pcap file to record all packets to), frame_id.
class RadarDriver {
 public:
  /// Throws InputError for unusable parameters; everything about the rig is reported and tried again.
  RadarDriver(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);
  ~RadarDriver();

 private:
  void publish(AdcCube&& cube);
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status);

  RadarConfig radar_;
  std::uint64_t radar_hash_ = 0;
  std::string frame_id_;
  RigOptions options_;
  ros::Publisher config_publisher_, adc_publisher_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
  FrameAssembler::Counters diagnosed_frames_;
  PacketReceiver::Counters diagnosed_packets_;
  std::uint64_t diagnosed_not_taken_ = 0;
  ros::WallTime diagnosed_at_;
  std::unique_ptr<Rig> rig_;  ///< last: its thread uses the rest
};

}  // namespace mmradartwin
