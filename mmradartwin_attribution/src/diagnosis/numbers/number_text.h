#pragma once

#include <string>

#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::numbers {

/// Text of a number with so many significant digits.
std::string number(double value, int digits = 3);

}  // namespace mmradartwin::diagnosis::numbers
