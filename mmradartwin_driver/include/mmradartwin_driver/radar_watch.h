#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "mmradartwin_driver/awr2243_link.h"

namespace mmradartwin {

/// An AWR2243 that is configured and started by one thread and watched by another, of this object's own: its events are
/// fetched while frames run, and a pulled USB cable is noticed, without who receives the samples waiting for USB.
class RadarWatch {
 public:
  using Level = awr2243::EventText::Level;
  using EventSink = std::function<void(Level, const std::string&)>;
  struct Event {
    Level level = Level::kInfo;
    std::string text;
    std::chrono::system_clock::time_point at;
  };
  struct State {
    bool configured = false, running = false;
    std::string problem;                   ///< one line with the next thing to do; empty while all is well
    std::string version;                   ///< of the firmware; empty before the radar was up
    std::optional<int> temperature_deg_c;  ///< at the last calibration
    std::uint64_t bring_ups = 0, starts = 0, events = 0, warnings = 0, errors = 0;
    std::deque<Event> latest;  ///< the last ten, newest first
  };

  /// Throws InputError where the firmware image cannot be read. `events` is called from either thread.
  RadarWatch(const Awr2243Registers& registers, const std::string& image_file, EventSink events);
  RadarWatch(const Awr2243Registers& registers, const std::string& image_file, EventSink events,
             const Awr2243Control::Options& options, Awr2243Link::OpenUsb open_usb);
  ~RadarWatch();  ///< stops the frames

  // As Awr2243Link's. A failure throws RigError and stands in the state until the radar is up again.
  bool prepare();  ///< true where the radar was brought up, and its LVDS clock began anew
  void start();
  void stop();
  /// The next prepare() brings the radar up again.
  void forget();

  State state() const;
  /// The radar could not be controlled for a while, and its USB port is there again: time to bring it up.
  bool returned() const { return returned_; }

 private:
  void run();
  void watchOnce();
  void took(const awr2243::EventText& event);
  void fail(const std::string& problem);
  template <class Action>
  void controlled(Action action);

  EventSink events_;
  Awr2243Link::OpenUsb open_usb_;
  mutable std::mutex state_mutex_;
  State state_;
  std::atomic<bool> lost_{false}, returned_{false}, stop_{false};
  std::mutex link_mutex_;  ///< of link_: one thread at a time
  Awr2243Link link_;       // behind the state: when it goes, it stops the frames, and that is an event
  std::thread thread_;
};

}  // namespace mmradartwin
