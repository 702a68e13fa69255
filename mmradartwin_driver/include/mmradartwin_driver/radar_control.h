#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>

namespace mmradartwin {

/// What a radar said by itself.
struct RadarEvent {
  enum class Level { kInfo, kWarning, kError };
  Level level = Level::kInfo;
  std::string text;
  std::chrono::system_clock::time_point at;
};

struct RadarHealth {
  bool configured = false, running = false;
  /// The radar could not be controlled for a while, and is there again: time to configure it.
  bool returned = false;
  std::string problem;                   ///< one line with the next thing to do; empty while all is well
  std::string version;                   ///< of the firmware; empty before the radar was up
  std::optional<int> temperature_deg_c;  ///< at the last calibration
  std::uint64_t bring_ups = 0, starts = 0, events = 0, warnings = 0, errors = 0;
  std::deque<RadarEvent> latest;  ///< the last ten, newest first
};

/// A radar that this host configures and starts. One thread controls it; any may ask for its health. What fails throws
/// RigError and stands in the health until the radar is configured again.
class RadarControl {
 public:
  using EventSink = std::function<void(RadarEvent::Level, const std::string&)>;  ///< may be called from any thread

  RadarControl() = default;
  RadarControl(const RadarControl&) = delete;
  RadarControl& operator=(const RadarControl&) = delete;
  virtual ~RadarControl() = default;  ///< stops the frames

  /// Brings the radar up, unless that has been done. True where it was, and its LVDS clock began anew: the capture
  /// card's FPGA must see that clock before it is configured.
  virtual bool configure() = 0;
  /// Frames run from their first chirp when this returns; those that ran were stopped. The card must be recording.
  virtual void start() = 0;
  virtual void stop() = 0;
  /// Lets go of the radar as it is; the next configure() brings it up again.
  virtual void forget() = 0;
  virtual RadarHealth health() const = 0;
};

}  // namespace mmradartwin
