#pragma once

#include <memory>
#include <string>

#include "emulated_ftdi.h"

namespace mmradartwin {

/// The emulated chip on a USB bus of umockdev's: sysfs, udev and usbfs of the processes that run under
/// umockdev-wrapper with this testbed show the capture card's RADAR_FTDI port, and libusb talks to it as to a real one.
/// The bus answers from a thread of its own.
class EmulatedUsbBus {
 public:
  explicit EmulatedUsbBus(EmulatedFtdi& chip);
  ~EmulatedUsbBus();

  /// False where this process was not started under umockdev-wrapper: it would see the host's own bus.
  static bool available();

  void plug();
  /// Transfers fail from now on, and the device is gone.
  void unplug();
  /// The device vanishes in the middle of things, after so many transfers more.
  void unplugAfter(int transfers);
  /// Fault: another program holds the interfaces.
  void setBusy(bool busy);
  /// For the environment of other processes: UMOCKDEV_DIR.
  std::string root() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mmradartwin
