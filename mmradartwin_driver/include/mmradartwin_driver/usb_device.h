#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace mmradartwin {

/// USB functions that the FTDI chip of the capture card needs. A failed transfer throws RigError.
class UsbTransport {
 public:
  virtual ~UsbTransport() = default;
  /// Vendor request to the device, without data.
  virtual void vendorRequest(std::uint8_t request, std::uint16_t value, std::uint16_t index) = 0;
  virtual void write(int interface, const std::vector<std::uint8_t>& bytes) = 0;
  /// One bulk transfer as the chip sends it, with two status bytes per packet. Empty after the time-out.
  virtual std::vector<std::uint8_t> read(int interface, std::chrono::milliseconds timeout) = 0;
  virtual std::size_t packet_bytes() const = 0;  ///< largest packet of a bulk-in endpoint
};

constexpr std::uint16_t kRadarUsbVendor = 0x0451;
constexpr std::uint16_t kRadarUsbProduct = 0xFD03;

/// The capture card's RADAR_FTDI port by libusb, its four interfaces claimed.
class UsbDevice : public UsbTransport {
 public:
  /// Opens the only such device. Throws RigError with what to do: not plugged in, several devices, no permission, used
  /// by another program.
  UsbDevice();
  ~UsbDevice() override;
  UsbDevice(const UsbDevice&) = delete;
  UsbDevice& operator=(const UsbDevice&) = delete;

  void vendorRequest(std::uint8_t request, std::uint16_t value, std::uint16_t index) override;
  void write(int interface, const std::vector<std::uint8_t>& bytes) override;
  std::vector<std::uint8_t> read(int interface, std::chrono::milliseconds timeout) override;
  std::size_t packet_bytes() const override { return packet_bytes_; }

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
  std::size_t packet_bytes_ = 512;
};

/// Advice on libusb's `error` in `action` ("open", "claim interface 0", ...).
std::string describeUsbError(int error, const std::string& action);

}  // namespace mmradartwin
