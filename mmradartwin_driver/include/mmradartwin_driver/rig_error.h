#pragma once

#include <stdexcept>
#include <string>

namespace mmradartwin {

/// Problem of host, network or card that a person can solve. The message is one line that says what it is and what to
/// do next. Trying again later may help, unlike with InputError.
class RigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace mmradartwin
