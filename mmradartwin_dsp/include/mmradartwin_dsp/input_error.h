#pragma once

#include <stdexcept>
#include <string>

namespace mmradartwin {

/// Bad input or use by a person: the message is one line that names file, key or pose and says what to do.
/// Programs print it and exit with status 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace mmradartwin
