#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "awr2243/awr2243_link.h"
#include "mmradartwin_driver/radar_control.h"

namespace mmradartwin {

/// AWR2243 that one thread controls and a thread of this object watches: it fetches events while frames run, and
/// notices a pulled USB cable. The receiver of samples never waits for USB.
class RadarWatch : public RadarControl {
 public:
  /// Throws InputError where the firmware image cannot be read. events: called from either thread.
  RadarWatch(const Awr2243Registers& registers, const std::string& image_file, EventSink events);
  RadarWatch(const Awr2243Registers& registers, const std::string& image_file, EventSink events,
             const Awr2243Control::Options& options, Awr2243Link::OpenUsb open_usb);
  ~RadarWatch() override;

  bool configure() override;
  void start() override;
  void stop() override;
  void forget() override;
  RadarHealth health() const override;

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
  RadarHealth state_;
  std::atomic<bool> lost_{false}, returned_{false}, stop_{false};
  std::mutex link_mutex_;  ///< of link_: one thread at a time
  Awr2243Link link_;       // after the state: its destructor stops the frames, which causes an event
  std::thread thread_;
};

}  // namespace mmradartwin
