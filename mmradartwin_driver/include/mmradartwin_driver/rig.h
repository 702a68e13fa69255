#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "mmradartwin_driver/dca1000_control.h"
#include "mmradartwin_driver/dropping_worker_queue.h"
#include "mmradartwin_driver/frame_assembler.h"
#include "mmradartwin_driver/packet_receiver.h"
#include "mmradartwin_driver/pcap_writer.h"
#include "mmradartwin_driver/radar_control.h"
#include "mmradartwin_driver/radar_devices.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

struct RigOptions {
  std::string host_ip = "192.168.33.30";
  std::string card_ip = "192.168.33.180";
  std::uint16_t config_port = kDca1000ConfigPort;
  std::uint16_t data_port = kDca1000DataPort;
  double packet_delay_us = 25;
  /// Kind of the radar, see radarDevice(). The rig configures this radar and starts it after each arming of the card,
  /// so that frames and recording begin together. Without a kind another program runs the radar.
  std::optional<RadarDevice> radar;
  std::string radar_firmware;  ///< image for a radar whose flash is empty
  bool configure_card = true;  ///< false: another program configures and arms it; only the data port is opened
  std::string record_pcap;     ///< file for everything between card and host; "" = none
  std::size_t hand_over_bytes = 128u << 20;  ///< of frames that may wait for a slow taker; at least 16 frames
  PacketReceiver::Options receiver;
  FrameAssembler::Options assembler;
};

/// State of the rig, for people and diagnostics.
struct RigState {
  enum class Phase { kConnecting, kArmed, kStreaming };
  Phase phase = Phase::kConnecting;
  std::string problem;  ///< one line with the next thing to do; empty where there is none
  std::optional<FpgaVersion> version;
  std::optional<RadarHealth> radar;          ///< where the rig configures it
  std::optional<std::uint16_t> last_status;  ///< of the card, since it was armed
  std::uint64_t armings = 0;
  double silent_s = 0;           ///< since the last packet, or since arming
  std::size_t buffer_bytes = 0;  ///< of the data socket, as granted
  FrameAssembler::Counters frames;
  PacketReceiver::Counters packets;
  std::uint64_t frames_not_taken = 0;  ///< dropped because the taker of frames was too slow
  std::uint64_t packets_recorded = 0;  ///< in the pcap
  std::uint64_t packets_not_recorded = 0;
};

/// The capture card, from its configuration to cubes. One thread of its own: opens the sockets, configures and arms the
/// card, receives, and does all of that again when the card or the network was gone, when the recording is completed,
/// or when the card says that it threw samples away (after which its count no longer tells the place of a byte). A
/// second thread delivers the cubes: whoever takes them may stall without a packet being lost.
///
/// Where the rig configures the radar too, that is brought up first (the card wants its LVDS clock), and its frames are
/// stopped before the card is armed and started after. Frames that come although the radar's USB port is gone are taken
/// as before; once the port is there again everything is set up anew.
class Rig {
 public:
  enum class Level { kInfo, kWarning, kError };
  using CubeSink = std::function<void(AdcCube&&)>;
  using EventSink = std::function<void(Level, const std::string&)>;

  /// Cubes are delivered from one thread, events are reported from two others; all belong to the rig. Throws InputError
  /// for options out of range.
  Rig(const RadarConfig& radar, const RigOptions& options, CubeSink cubes, EventSink events);
  ~Rig();  ///< ends the thread and the recording
  RigState state() const;

 private:
  using Clock = std::chrono::steady_clock;
  void run();
  void open();
  void prepareRadar();
  void configure();
  void arm();
  /// Receives until the card must be armed again.
  void stream();
  /// Handles a status of the card. True where it ended the recording; the card has then been stopped.
  bool handleStatus(std::uint16_t status);
  bool receiveBatch(int timeout_ms);
  /// Throws RigError where the radar was started and no sample arrived.
  void checkFirstSamples(Clock::duration silent);
  void report(const std::string& problem);
  void setPhase(RigState::Phase phase);
  void publishState();
  void waitToRetry();
  void watchRecording();

  RadarConfig radar_;
  RigOptions options_;
  EventSink events_;
  std::unique_ptr<PcapWriter> recording_;  // used by the taps of receiver and control
  bool recording_failed_ = false;
  DroppingWorkerQueue<AdcCube> deliveries_;
  FrameAssembler assembler_;
  std::unique_ptr<PacketReceiver> receiver_;
  std::unique_ptr<Dca1000Control> control_;
  std::unique_ptr<RadarControl> radar_control_;
  PacketReceiver::Counters earlier_;  ///< of receivers that were closed
  bool configured_ = false;
  const Clock::time_point started_ = Clock::now();
  Clock::time_point last_data_{};
  Clock::time_point last_report_{};
  std::uint16_t told_status_ = 0;
  Clock::time_point told_status_at_{};

  mutable std::mutex mutex_;
  RigState state_;
  Clock::time_point silent_since_{};

  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace mmradartwin
