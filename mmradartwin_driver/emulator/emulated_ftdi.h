#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "emulated_awr2243.h"

namespace mmradartwin {

/// The four-port FTDI chip of the capture card, wired to an emulated radar: an interpreter of the serial engine's
/// commands on ports A and B, pins on C and D. Bytes in and out are those of the USB endpoints. Written from FTDI's
/// description of the commands, apart from the driver. Calls from several threads are serialised.
class EmulatedFtdi {
 public:
  explicit EmulatedFtdi(EmulatedAwr2243& radar) : radar_(radar) {}

  bool vendorRequest(int request, int value, int index);
  void write(int port, const std::vector<std::uint8_t>& bytes);
  /// What one bulk transfer of at most `size` bytes brings: packets of 512, each led by two status bytes.
  std::vector<std::uint8_t> read(int port, std::size_t size);

  std::vector<std::string> violations;
  bool serial_engine_dead = false;  ///< fault: ports A and B take no commands
  std::mutex mutex;                 ///< hold it to look at the radar while another thread drives the chip
  int words = 0;                    ///< through the SPI port
  int transfers = 0;                ///< bulk transfers out to port A

 private:
  struct Port {
    int mode = 0;
    std::uint8_t bit_bang_outputs = 0;
    std::uint8_t value = 0, outputs = 0;
    std::deque<std::uint8_t> commands;
    std::deque<std::uint8_t> answers;
  };
  /// Carries out the first command of the port, false while it is not complete.
  bool step(int number);
  void setPins(int number, std::uint8_t value, std::uint8_t outputs);
  std::uint8_t pins(int number);
  void setBits(int number, std::uint8_t value);

  EmulatedAwr2243& radar_;
  Port ports_[4];
  bool selected_ = false;
  int bytes_in_pulse_ = 0;
};

}  // namespace mmradartwin
