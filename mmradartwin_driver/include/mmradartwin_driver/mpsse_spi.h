#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "mmradartwin_driver/usb_device.h"

namespace mmradartwin {

/// One of the FTDI chip's four ports. A and B have a serial engine (MPSSE), C and D only pins (bit bang).
class FtdiChannel {
 public:
  enum class Mode : std::uint8_t { kReset = 0, kBitBang = 1, kMpsse = 2 };

  FtdiChannel(UsbTransport& usb, int channel) : usb_(usb), channel_(channel) {}

  /// Resets the port, empties its buffers, and sets the mode. The pins in `outputs` are driven in kBitBang.
  void open(Mode mode, std::uint8_t outputs);
  void write(const std::vector<std::uint8_t>& bytes);
  /// Reads exactly `size` bytes without the chip's status bytes. Throws RigError after `timeout`.
  std::vector<std::uint8_t> read(std::size_t size, std::chrono::milliseconds timeout = std::chrono::seconds(1));
  /// Synchronises with the chip: sends a command that no engine knows, waits for the chip's error, and discards
  /// everything before it. Throws RigError where the error does not come.
  void synchronise();
  char name() const { return static_cast<char>('A' + channel_); }

 private:
  /// Moves the chip's data into received_. False after the time-out without a transfer.
  bool receive(std::chrono::milliseconds timeout);

  UsbTransport& usb_;
  int channel_;
  std::deque<std::uint8_t> received_;
};

/// The radar as its host sees it: words of 16 bit by SPI, an interrupt line, reset and boot mode.
class RadarPort {
 public:
  enum class BootMode { kFunctional, kFlash };  ///< sense-on-power 4 and 5

  virtual ~RadarPort() = default;
  virtual void setBootMode(BootMode mode) = 0;
  virtual void setReset(bool active) = 0;
  /// Writes an even number of bytes; each pair is a word, little endian.
  virtual void writeWords(const std::vector<std::uint8_t>& bytes) = 0;
  virtual std::vector<std::uint8_t> readWords(std::size_t words) = 0;
  virtual bool hostInterrupt() = 0;
};

/// RadarPort through the capture card's FTDI chip. SPI at 10 MHz is on port A, with one chip-select pulse per word and
/// a message's words in one transfer. HOST_INTR is on port B, NRST on C, the boot mode on D.
class FtdiRadarPort : public RadarPort {
 public:
  /// Sets the chip up. The radar's reset and boot mode stay unchanged until they are set. Throws RigError.
  explicit FtdiRadarPort(UsbTransport& usb);

  void setBootMode(BootMode mode) override;
  void setReset(bool active) override;
  void writeWords(const std::vector<std::uint8_t>& bytes) override;
  std::vector<std::uint8_t> readWords(std::size_t words) override;
  bool hostInterrupt() override;

 private:
  FtdiChannel spi_, interrupt_, reset_, boot_;
};

}  // namespace mmradartwin
