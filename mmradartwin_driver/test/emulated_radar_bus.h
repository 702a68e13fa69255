#pragma once

#include "../emulator/emulated_ftdi.h"
#include "deployment_registers.h"
#include "mmradartwin_driver/rig_error.h"
#include "mmradartwin_driver/usb_device.h"

namespace mmradartwin {

/// The emulated chip without a USB bus between.
class DirectUsb : public UsbTransport {
 public:
  explicit DirectUsb(EmulatedFtdi& chip) : chip_(chip) {}

  void vendorRequest(std::uint8_t request, std::uint16_t value, std::uint16_t index) override {
    check();
    if (!chip_.vendorRequest(request, value, index))
      throw RigError("the chip stalls request " + std::to_string(request));
  }
  void write(int interface, const std::vector<std::uint8_t>& bytes) override {
    check();
    chip_.write(interface, bytes);
  }
  std::vector<std::uint8_t> read(int interface, std::chrono::milliseconds) override {
    check();
    return chip_.read(interface, 4096);
  }
  std::size_t packet_bytes() const override { return 512; }

  int transfers_until_unplugged = -1;  ///< negative: never

 private:
  void check() {
    if (transfers_until_unplugged > 0) --transfers_until_unplugged;
    if (transfers_until_unplugged == 0) throw RigError("unplugged");
  }
  EmulatedFtdi& chip_;
};

}  // namespace mmradartwin
