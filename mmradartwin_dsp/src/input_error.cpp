#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kLongestMessage = 4000;

/// Bytes of the UTF-8 character at `at`, 0 where there is none.
std::size_t characterBytes(const std::string& text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const unsigned lead = byte(at);
  const std::size_t size = lead < 0x80                   ? 1
                           : lead >= 0xc2 && lead < 0xe0 ? 2
                           : lead >= 0xe0 && lead < 0xf0 ? 3
                           : lead >= 0xf0 && lead < 0xf5 ? 4
                                                         : 0;
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(at + i) & 0xc0) != 0x80) return 0;
  }
  return size;
}

}  // namespace

std::string oneLine(const std::string& text) {
  std::string line;
  for (std::size_t at = 0; at < text.size();) {
    if (line.size() > kLongestMessage) return line + " ...";
    const std::size_t size = characterBytes(text, at);
    const auto byte = static_cast<unsigned char>(text[at]);
    // U+0080 to U+009F are control characters too; some terminals obey them.
    const bool control = size == 1 ? byte < 0x20 || byte == 0x7f
                                   : size == 2 && byte == 0xc2 && static_cast<unsigned char>(text[at + 1]) < 0xa0;
    if (size == 0) {
      line += '?';
    } else if (control) {
      line += ' ';
    } else {
      line.append(text, at, size);
    }
    at += size == 0 ? 1 : size;
  }
  return line;
}

}  // namespace mmradartwin
