#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace mmradartwin {

/// Bytes of hexadecimal digits; blanks part them for the reader.
inline std::vector<std::uint8_t> fromHex(const std::string& text) {
  std::vector<std::uint8_t> bytes;
  std::string digits;
  for (const char c : text) {
    if (c != ' ') digits += c;
  }
  for (std::size_t i = 0; i < digits.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

/// The message that starts the frames, sequence number 1, built by hand from the tables of the interface document.
inline std::vector<std::uint8_t> sensorStartBytes() {
  return fromHex("3412 2143 8102 1800 0014 0000 0100 65e9 4001 0800 0100 0000 9476 e063");
}

}  // namespace mmradartwin
