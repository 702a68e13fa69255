#include "emulated_ftdi.h"

#include <algorithm>

namespace mmradartwin {

bool EmulatedFtdi::vendorRequest(int request, int value, int index) {
  const std::lock_guard<std::mutex> lock(mutex);
  if (index < 1 || index > 4) return false;
  Port& port = ports_[index - 1];
  switch (request) {
    case 0x00:
      if (value == 0 || value == 1) port.commands.clear();
      if (value == 0 || value == 2) port.answers.clear();
      return value >= 0 && value <= 2;
    case 0x09:
      return value >= 1 && value <= 255;
    case 0x0B:
      if (value >> 8 == 2 && index > 2) return false;  // only A and B have a serial engine
      port.mode = value >> 8;
      port.bit_bang_outputs = static_cast<std::uint8_t>(value & 0xFF);
      port.commands.clear();
      port.answers.clear();
      return true;
    default:
      return false;
  }
}

void EmulatedFtdi::write(int number, const std::vector<std::uint8_t>& bytes) {
  const std::lock_guard<std::mutex> lock(mutex);
  Port& port = ports_[number];
  if (number == 0) ++transfers;
  if (port.mode == 1) {
    for (const std::uint8_t byte : bytes) setBits(number, byte);
    return;
  }
  if (port.mode != 2 || serial_engine_dead) return;
  port.commands.insert(port.commands.end(), bytes.begin(), bytes.end());
  while (!port.commands.empty() && step(number)) continue;
}

std::vector<std::uint8_t> EmulatedFtdi::read(int number, std::size_t size) {
  const std::lock_guard<std::mutex> lock(mutex);
  std::deque<std::uint8_t>& answers = ports_[number].answers;
  std::vector<std::uint8_t> bytes;
  do {
    bytes.push_back(0x32);
    bytes.push_back(0x60);
    for (int i = 0; i < 510 && bytes.size() < size && !answers.empty(); ++i) {
      bytes.push_back(answers.front());
      answers.pop_front();
    }
  } while (!answers.empty() && bytes.size() % 512 == 0 && bytes.size() + 2 < size);
  return bytes;
}

bool EmulatedFtdi::step(int number) {
  Port& port = ports_[number];
  std::deque<std::uint8_t>& in = port.commands;
  const std::uint8_t command = in[0];
  std::size_t size = 1;
  switch (command) {
    case 0x80:
    case 0x82:
    case 0x86:
      size = 3;
      break;
    case 0x20:
      size = 3;
      break;
    case 0x11:
      if (in.size() < 3) return false;
      size = 3 + in[1] + 256u * in[2] + 1;
      break;
    case 0x81:
    case 0x83:
    case 0x84:
    case 0x85:
    case 0x87:
    case 0x8A:
    case 0x8B:
    case 0x8C:
    case 0x8D:
    case 0x96:
    case 0x97:
      break;
    default:
      port.answers.push_back(0xFA);
      port.answers.push_back(command);
      in.pop_front();
      return true;
  }
  if (in.size() < size) return false;
  std::vector<std::uint8_t> bytes(in.begin(), in.begin() + static_cast<std::ptrdiff_t>(size));
  in.erase(in.begin(), in.begin() + static_cast<std::ptrdiff_t>(size));
  if (command == 0x80) setPins(number, bytes[1], bytes[2]);
  if (command == 0x81) port.answers.push_back(pins(number));
  if (command == 0x11 || command == 0x20) {
    const std::size_t count = bytes[1] + 256u * bytes[2] + 1;
    if (number != 0 || !selected_ || count != 2) {
      violations.push_back("clocks " + std::to_string(count) + " bytes on port " + std::to_string(number) +
                           (selected_ ? "" : " without chip select"));
      if (command == 0x20) port.answers.insert(port.answers.end(), count, 0xFF);
      return true;
    }
    bytes_in_pulse_ += 2;
    const bool mosi_high = ports_[0].value & 2;
    const auto out = static_cast<std::uint16_t>(command == 0x11 ? bytes[3] << 8 | bytes[4]
                                                : mosi_high     ? 0xFFFF
                                                                : 0x0000);
    const std::uint16_t back = radar_.transfer(out);
    ++words;
    if (command == 0x20) {
      port.answers.push_back(static_cast<std::uint8_t>(back >> 8));
      port.answers.push_back(static_cast<std::uint8_t>(back & 0xFF));
    }
  }
  return true;
}

void EmulatedFtdi::setPins(int number, std::uint8_t value, std::uint8_t outputs) {
  Port& port = ports_[number];
  port.value = value;
  port.outputs = outputs;
  if (number != 0) {
    if (outputs & 0x20) violations.push_back("drives HOST_INTR");
    return;
  }
  if ((outputs & 0x4F) != 0x4B) violations.push_back("port A drives the wrong pins");
  if (!(value & 0x40)) {
    violations.push_back("switches the supply off");
    radar_.powerOff();
  }
  const bool select = !(value & 0x08);
  if (select && !selected_ && (value & 1)) violations.push_back("the clock idles high");
  if (select && !selected_) bytes_in_pulse_ = 0;
  if (!select && selected_ && bytes_in_pulse_ != 2) {
    violations.push_back("a chip-select pulse of " + std::to_string(bytes_in_pulse_) + " bytes");
  }
  selected_ = select;
}

std::uint8_t EmulatedFtdi::pins(int number) {
  const Port& port = ports_[number];
  std::uint8_t level = static_cast<std::uint8_t>(port.value & port.outputs);
  if (number == 1 && radar_.hostInterrupt()) level |= 0x20;
  if (number == 0) level |= 0x80;  // no error signalled
  return level;
}

void EmulatedFtdi::setBits(int number, std::uint8_t value) {
  const std::uint8_t outputs = ports_[number].bit_bang_outputs;
  // Pins that are not driven are pulled up.
  const auto level = static_cast<std::uint8_t>((value & outputs) | ~outputs);
  if (number == 2) radar_.setReset(!(level & 0x40) || !(level & 0x80));
  if (number == 3) radar_.setBootMode(level >> 2 & 1, level >> 3 & 1, level >> 4 & 1);
}

}  // namespace mmradartwin
