#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "emulated_lvds.h"

namespace mmradartwin {

/// An AWR2243 at its pins: reset, boot mode, SPI, interrupt. Written from TI's interface control document alone; shares
/// no code with the driver. It takes the framing apart word by word, checks direction, length and values of every
/// sub-block and the order in which they come, and answers, refuses, keeps silent and reports as the document says.
class EmulatedAwr2243 {
 public:
  /// Each counts down by one with every message it spoils.
  struct Faults {
    int skip = 0;            ///< commands that are let pass before the faults below strike
    int answer_header = 0;   ///< a bit of the answer's header is flipped on the wire
    int answer_crc = 0;      ///< a bit of the answer's CRC is flipped
    int answer_lost = 0;     ///< a command is carried out, and never answered
    int answer_garbage = 0;  ///< words that are no SYNC before the answer
    int answer_delayed = 0;  ///< the answer comes after `delay`
    int deaf = 0;            ///< a command is not heard at all
    int command_header = 0;  ///< a bit of the command's header is flipped on the wire
    int command_data = 0;    ///< a bit of the command's data is flipped
    std::chrono::milliseconds delay{300};
    bool no_boot = false;            ///< nothing happens after reset
    bool interrupt_stuck = false;    ///< HOST_INTR stays up
    bool calibration_fails = false;  ///< of the TX power
    bool front_end_fault = false;    ///< a CPU fault instead of the calibration's report
    bool no_frame_event = false;     ///< FRAME_TRIGGER_RDY does not come
  };
  struct Command {
    std::uint16_t sub_block = 0;
    std::vector<std::uint8_t> data;
    int sequence = 0;
    bool retry = false;
    int remaining_chunks = 0;
  };

  explicit EmulatedAwr2243(bool firmware_in_flash = true) : has_firmware_(firmware_in_flash) {}

  void setReset(bool low);
  void setBootMode(int d2, int d3, int d4) { boot_mode_ = d2 | d3 << 1 | d4 << 2; }
  void powerOff();
  bool hostInterrupt();
  /// One chip-select pulse of sixteen clocks.
  std::uint16_t transfer(std::uint16_t mosi);

  /// An asynchronous event of its own accord, from the front end (0x1000..) or the main processor (0x5000..).
  void raise(std::uint16_t event, const std::vector<std::uint8_t>& data);

  Faults faults;
  std::vector<Command> commands;        ///< those carried out
  std::vector<std::string> violations;  ///< of the protocol or of the order, as the radar sees them
  int headers_refused = 0, crcs_refused = 0, repeats = 0;
  std::vector<std::uint8_t> flash;  ///< the last image that came whole, with its CRC
  bool frames_run = false;
  /// Called whenever the lanes begin to carry something else.
  std::function<void(const LvdsActivity&)> on_lanes;

 private:
  using Clock = std::chrono::steady_clock;
  struct Outgoing {
    Clock::time_point when;
    std::vector<std::uint16_t> words;
  };
  enum class State { kHunt, kHeader, kBody, kDummy };

  void received(std::uint16_t word);
  void handle();
  /// What came of the blocks of a message: those of the answer, how many, and the block that an error is of.
  struct Outcome {
    std::vector<std::uint8_t> blocks;
    int count = 0, error = 0;
    unsigned offender = 0;
  };
  void answer();
  Outcome carryOutBlocks(const std::vector<std::uint8_t>& covered, int sequence, bool retry);
  void announce(unsigned sub_block);
  void spoilAnswer();
  bool strikes(int& fault) const;
  /// The answer's error code, 0 where all is well; `reply` is the payload of a read command.
  int carryOut(const Command& command, std::vector<std::uint8_t>& reply);
  int checkOrder(const Command& command) const;
  int checkValues(const Command& command) const;
  int download(const Command& command);
  int trigger(const Command& command);
  LvdsActivity activity() const;
  void tellLanes() const {
    if (on_lanes) on_lanes(activity());
  }
  void event(std::uint16_t id, const std::vector<std::uint8_t>& data, std::chrono::milliseconds after);
  void send(std::uint16_t opcode, std::uint16_t flags, const std::vector<std::uint8_t>& blocks, int block_count,
            std::chrono::microseconds after);
  bool configured(std::uint16_t id) const { return last_.count(id) != 0; }

  bool in_reset_ = true;
  int boot_mode_ = -1;
  bool has_firmware_;
  State state_ = State::kHunt;
  std::uint16_t previous_ = 0;
  int dummies_ = 0;
  std::vector<std::uint16_t> words_;
  std::deque<Outgoing> outgoing_;
  std::deque<std::uint16_t> sending_;
  bool main_crc32_ = false, front_end_crc32_ = false, front_end_up_ = false, calibrated_ = false;
  std::map<std::uint16_t, std::vector<std::uint8_t>> last_;
  int last_sequence_ = -1;
  std::vector<std::uint16_t> last_answer_;
  std::vector<std::uint8_t> incoming_image_;
  int expected_chunks_ = -1;
};

}  // namespace mmradartwin
