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
  /// The radar's kind, see radarDevice(). The rig configures such a radar, and starts it whenever the card has been
  /// armed, so that frames and recording begin together. Without it another program runs the radar.
  std::optional<RadarDevice> radar;
  std::string radar_firmware;  ///< image for a radar whose flash is empty
  bool configure_card = true;  ///< false: another program configures and arms it, only the data port is opened
  std::string record_pcap;     ///< records everything between card and host there; "" = nowhere
  std::size_t hand_over_bytes = 128u << 20;  ///< of frames that may wait for a slow taker; at least 16 frames do
  PacketReceiver::Options receiver;
  FrameAssembler::Options assembler;
};

/// What the rig is doing, for people and diagnostics.
struct RigState {
  enum class Phase { kConnecting, kArmed, kStreaming };
  Phase phase = Phase::kConnecting;
  std::string problem;  ///< one line that says the next thing to do; empty while all is well
  std::optional<FpgaVersion> version;
  std::optional<RadarHealth> radar;          ///< where the rig configures it
  std::optional<std::uint16_t> last_status;  ///< of the card, since it was armed
  std::uint64_t armings = 0;
  double silent_s = 0;           ///< since the last packet, or since arming
  std::size_t buffer_bytes = 0;  ///< of the data socket, as granted
  FrameAssembler::Counters frames;
  PacketReceiver::Counters packets;
  std::uint64_t frames_not_taken = 0;  ///< dropped because whoever takes the frames was too slow
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

  /// Cubes are delivered from one thread, events reported from two others, all the rig's own. Throws InputError for
  /// options out of range.
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
  /// Receives until the card must be armed anew.
  void stream();
  /// True where the status ended the recording: the card has been stopped.
  bool handleStatus(std::uint16_t status);
  bool receiveBatch(int timeout_ms);
  /// Throws where the radar was started and nothing came.
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

  mutable std::mutex mutex_;
  RigState state_;
  Clock::time_point silent_since_{};

  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace mmradartwin
