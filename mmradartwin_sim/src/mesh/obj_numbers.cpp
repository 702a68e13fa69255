#include "mesh/obj_numbers.h"

#include <cctype>

namespace mmradartwin {
namespace {

bool isDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }
bool isBlank(char c) { return c == ' ' || c == '\t'; }

/// Whether a line that begins at `at` holds coordinates: v, vn, vt or vp.
bool holdsCoordinates(const std::string& text, std::size_t at) {
  while (at < text.size() && isBlank(text[at])) ++at;
  if (at >= text.size() || text[at] != 'v') return false;
  const std::size_t blank = at + 1 < text.size() && std::string("ntp").find(text[at + 1]) != std::string::npos ? 2 : 1;
  return at + blank < text.size() && isBlank(text[at + blank]);
}

}  // namespace

std::optional<std::string> withDigitsAroundPoints(const std::string& obj) {
  std::string mended;
  mended.reserve(obj.size() + obj.size() / 8);
  bool coordinates = holdsCoordinates(obj, 0), changed = false;
  for (std::size_t i = 0; i < obj.size(); ++i) {
    const char c = obj[i];
    const char before = i > 0 ? obj[i - 1] : '\n', after = i + 1 < obj.size() ? obj[i + 1] : '\n';
    if (c == '\n' || c == '\r') {
      const bool continued = before == '\\';
      if (!continued) coordinates = holdsCoordinates(obj, i + 1);
    }
    const bool of_number = coordinates && c == '.' && (isDigit(before) || isDigit(after));
    if (of_number && !isDigit(before)) mended += '0';
    mended += c;
    if (of_number && !isDigit(after)) mended += '0';
    changed = changed || (of_number && !(isDigit(before) && isDigit(after)));
  }
  if (!changed) return std::nullopt;
  return mended;
}

}  // namespace mmradartwin
