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

/// The AWR2243 over its SPI port: commands with acknowledgement and retry, asynchronous events, and the bring-up
/// sequence of the interface control document (chapter 6.1). One thread at a time. What the radar or the USB chip do
/// not do in time throws RigError naming the step; the way on is bringUp() again, or a new port after a disconnect.
class Awr2243Control {
 public:
  struct Options {
    std::chrono::milliseconds answer_timeout{1000};
    std::chrono::milliseconds first_chunk_timeout{10000};  ///< the flash is erased then
    std::chrono::milliseconds interrupt_fall_timeout{100};
    std::chrono::milliseconds power_up_timeout{2000};
    std::chrono::milliseconds boot_error_wait{100};  ///< for the report that there is no firmware
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

  /// From reset to ready for start(): power-up, the firmware from `image` where it is not empty, configuration,
  /// calibration, data path, frame. A radar without firmware in its flash and no image is an InputError.
  void bringUp(const Awr2243Registers& registers, const std::vector<std::uint8_t>& image = {},
               const std::string& image_name = "");
  /// Frames run when this returns. The capture card must be recording before.
  void start();
  /// Returns after the frame that was under way.
  void stop();
  /// Delivers events that are waiting.
  void poll();

  awr2243::Version version();  ///< of the main processor's firmware
  /// Of the last calibration; the interface document gives no other way to read the temperature that is used here.
  std::optional<int> temperature_deg_c() const { return temperature_deg_c_; }

  /// Ramps on all lanes instead of samples; sent between bringUp() and start().
  void setTestPattern(const awr2243::TestPattern& pattern);
  /// Two synthetic targets instead of the antennas; for debugging only, and the profile must be sent again afterwards,
  /// which disableTestSource() does.
  void enableTestSource(const awr2243::TestSource& source);
  void disableTestSource();

  /// Sends `message` and returns its answer. Throws RigError naming `step`: refused, or no answer after all attempts.
  MmwaveLinkMessage command(const std::string& step, MmwaveLinkMessage message,
                            std::optional<std::chrono::milliseconds> timeout = std::nullopt);
  const Counters& counters() const { return counters_; }
  /// Reported by the radar since its front end is up, for which it must be brought up again; empty while all is well.
  const std::string& fault() const { return fault_; }

 private:
  using Clock = std::chrono::steady_clock;
  void reset();
  void download(const std::vector<std::uint8_t>& image, const std::string& name);
  template <class Payload>
  void set(const std::string& step, const Payload& payload);
  /// Empty after the deadline; a garbled message leaves garbled_ set.
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
  bool running_front_end_ = false;  ///< faults before that are of the boot ROM and no reason to give up
  std::map<std::uint16_t, SubBlock> seen_;
  std::string fault_;
  std::optional<int> temperature_deg_c_;
  std::optional<Awr2243Registers> registers_;
};

/// Reads a firmware image. Throws InputError where the file cannot be read.
std::vector<std::uint8_t> loadFirmwareImage(const std::string& file);

}  // namespace mmradartwin
