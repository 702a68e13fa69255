#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "awr2243/awr2243_messages.h"
#include "awr2243/awr2243_quantised.h"
#include "mmradartwin_driver/mpsse_spi.h"

namespace mmradartwin {

/// The AWR2243 on its SPI port: commands with acknowledgement and retry, asynchronous events, and the bring-up sequence
/// of the interface control document (chapter 6.1). One thread at a time. A time-out of the radar or the USB chip
/// throws RigError naming the step. To continue, bringUp() is called again, or a new port is opened after a disconnect.
class Awr2243Control {
 public:
  struct Options {
    std::chrono::milliseconds answer_timeout{1000};
    std::chrono::milliseconds first_chunk_timeout{10000};  ///< the flash is erased meanwhile
    std::chrono::milliseconds interrupt_fall_timeout{100};
    std::chrono::milliseconds power_up_timeout{2000};
    std::chrono::milliseconds boot_error_wait{100};  ///< wait for the report that there is no firmware
    std::chrono::milliseconds calibration_timeout{2000};
    std::chrono::milliseconds reset_pulse{10};
    int attempts = 3;
  };
  struct Counters {
    std::uint64_t commands = 0, retries = 0, refusals_for_crc = 0, garbled = 0, stale = 0, events = 0;
  };
  using EventSink = std::function<void(const awr2243::EventText&, const SubBlock&)>;

  explicit Awr2243Control(RadarPort& port, EventSink events = nullptr);
  Awr2243Control(RadarPort& port, EventSink events, const Options& options);

  /// Brings the radar from reset to ready for start(): power-up, the firmware in `image` where it is not empty,
  /// configuration, calibration, data path, frame. Throws InputError where the radar has no firmware in its flash and
  /// `image` is empty.
  void bringUp(const Awr2243Registers& registers, const std::vector<std::uint8_t>& image = {},
               const std::string& image_name = "");
  /// Starts frames; they run when this returns. The capture card must be recording before.
  void start();
  /// Stops frames; returns after the current frame.
  void stop();
  /// Delivers events that are waiting.
  void poll();

  awr2243::Version version();  ///< of the main processor's firmware
  /// Temperature at the last calibration. The interface document gives no other way to read it that is used here.
  std::optional<int> temperature_deg_c() const { return temperature_deg_c_; }

  /// Sends ramps on all lanes instead of samples; to be called between bringUp() and start().
  void setTestPattern(const awr2243::TestPattern& pattern);
  /// Sends two synthetic targets instead of the antennas' signals, for debugging only. The profile must be sent again
  /// afterwards, which disableTestSource() does.
  void enableTestSource(const awr2243::TestSource& source);
  void disableTestSource();

  /// Sends `message` and returns its answer. Throws RigError naming `step` where the radar refuses, or does not answer
  /// after all attempts.
  MmwaveLinkMessage command(const std::string& step, MmwaveLinkMessage message,
                            std::optional<std::chrono::milliseconds> timeout = std::nullopt);
  const Counters& counters() const { return counters_; }
  /// Fault that the radar reported since its front end was up, after which it must be brought up again; empty where
  /// there is none.
  const std::string& fault() const { return fault_; }

 private:
  using Clock = std::chrono::steady_clock;
  void reset();
  void download(const std::vector<std::uint8_t>& image, const std::string& name);
  template <class Payload>
  void set(const std::string& step, const Payload& payload);
  /// Nothing after the deadline; a damaged message sets garbled_.
  std::optional<MmwaveLinkMessage> receive(Clock::time_point deadline);
  bool waitInterrupt(bool level, Clock::time_point deadline);
  void dispatch(const MmwaveLinkMessage& message);
  void waitEvent(const std::string& step, std::uint16_t event, std::chrono::milliseconds timeout);

  RadarPort& port_;
  EventSink events_;
  Options options_;
  Counters counters_;
  std::uint8_t sequence_ = 0;
  bool garbled_ = false;
  bool running_front_end_ = false;  ///< faults before that are the boot ROM's and no reason to stop
  std::map<std::uint16_t, SubBlock> seen_;
  std::string fault_;
  std::optional<int> temperature_deg_c_;
  std::optional<Awr2243Registers> registers_;
};

/// Reads a firmware image. Throws InputError where the file cannot be read.
std::vector<std::uint8_t> loadFirmwareImage(const std::string& file);

}  // namespace mmradartwin
