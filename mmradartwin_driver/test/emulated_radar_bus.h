#pragma once

#include "../emulator/emulated_ftdi.h"
#include "awr2243/awr2243_quantised.h"
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

/// The paper's deployment in the device's units.
inline Awr2243Registers deploymentRegisters() {
  Awr2243Registers registers;
  registers.start_frequency = 1435384036;
  registers.slope = 1553;
  registers.idle = 700;
  registers.adc_start = 600;
  registers.ramp_end = 2000;
  registers.samples = 64;
  registers.sample_rate_ksps = 5000;
  registers.rx_gain_db = 40;
  registers.rx_mask = 0xF;
  registers.chirp_tx_mask = {1, 4};
  registers.loops = 1;
  registers.frame_period = 10000000;
  return registers;
}

}  // namespace mmradartwin
