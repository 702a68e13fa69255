#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "awr2243/awr2243_control.h"
#include "mmradartwin_driver/usb_device.h"

namespace mmradartwin {

/// Connection to an AWR2243 for the rig: opened, configured and started on demand, and again after a cable was pulled
/// or the radar reported a fault. One thread at a time. A failure throws RigError; the same call may then be made
/// again.
class Awr2243Link {
 public:
  using OpenUsb = std::function<std::unique_ptr<UsbTransport>()>;

  /// Reads the firmware image where `image_file` is not empty. Throws InputError where it cannot be read.
  Awr2243Link(const Awr2243Registers& registers, const std::string& image_file, Awr2243Control::EventSink events);
  Awr2243Link(const Awr2243Registers& registers, const std::string& image_file, Awr2243Control::EventSink events,
              const Awr2243Control::Options& options, OpenUsb open_usb);
  ~Awr2243Link();  ///< stops the frames

  /// Opens the USB port and brings the radar up, where that has not been done. Its LVDS clock then runs, which the
  /// capture card's FPGA must see before it is configured.
  void prepare();
  /// Starts frames; they run from their first chirp when this returns. Running frames are stopped first. The card must
  /// be recording.
  void start();
  void stop();
  /// Releases the radar without changing it; the next prepare() brings it up again.
  void close() { drop(); }
  /// Delivers events. Throws RigError where the radar reported a fault or is disconnected.
  void poll();

  bool running() const { return running_; }
  const std::string& version() const { return version_; }  ///< empty before prepare()
  std::optional<int> temperature_deg_c() const;

 private:
  /// Runs `action`. Where it fails everything is closed, so that the next prepare() starts from the beginning.
  template <class Action>
  void guarded(Action action);
  void drop();

  Awr2243Registers registers_;
  std::string image_file_;
  std::vector<std::uint8_t> image_;
  Awr2243Control::EventSink events_;
  Awr2243Control::Options options_;
  OpenUsb open_usb_;
  std::unique_ptr<UsbTransport> usb_;
  std::unique_ptr<RadarPort> port_;
  std::unique_ptr<Awr2243Control> control_;
  bool running_ = false;
  std::string version_;
};

}  // namespace mmradartwin
