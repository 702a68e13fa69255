#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>

namespace mmradartwin {

/// Event that a radar reported on its own.
struct RadarEvent {
  enum class Level { kInfo, kWarning, kError };
  Level level = Level::kInfo;
  std::string text;
  std::chrono::system_clock::time_point at;
};

struct RadarHealth {
  bool configured = false, running = false;
  /// The radar was out of control for a while and is available again: it must be configured.
  bool returned = false;
  std::string problem;                   ///< one line with the next thing to do; empty where there is none
  std::string version;                   ///< of the firmware; empty before the radar was up
  std::optional<int> temperature_deg_c;  ///< at the last calibration
  std::uint64_t bring_ups = 0, starts = 0, events = 0, warnings = 0, errors = 0;
  std::deque<RadarEvent> latest;  ///< the last ten, newest first
};

/// Radar that this host configures and starts. One thread controls it; any thread may ask for its health. A failure
/// throws RigError and stays in the health until the radar is configured again.
class RadarControl {
 public:
  using EventSink = std::function<void(RadarEvent::Level, const std::string&)>;  ///< may be called from any thread

  RadarControl() = default;
  RadarControl(const RadarControl&) = delete;
  RadarControl& operator=(const RadarControl&) = delete;
  virtual ~RadarControl() = default;  ///< stops the frames

  /// Brings the radar up where it is not up yet. True where it did so and the LVDS clock restarted: the capture card's
  /// FPGA must see that clock before it is configured.
  virtual bool configure() = 0;
  /// Starts frames; they run from their first chirp when this returns. Running frames are stopped first. The card must
  /// be recording.
  virtual void start() = 0;
  virtual void stop() = 0;
  /// Releases the radar without changing it; the next configure() brings it up again.
  virtual void forget() = 0;
  virtual RadarHealth health() const = 0;
};

}  // namespace mmradartwin
