#pragma once

#include <stdexcept>
#include <string>

namespace mmradartwin {

/// `text` as it can stand in a terminal or a log: control characters become blanks, bytes that are no UTF-8 question
/// marks, and more than some 4000 bytes are cut off.
std::string oneLine(const std::string& text);

/// Bad input or use by a person: the message is one line (see oneLine) that names file, key or pose and says what to
/// do. Programs print it and exit with status 2.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(oneLine(message)) {}
};

}  // namespace mmradartwin
