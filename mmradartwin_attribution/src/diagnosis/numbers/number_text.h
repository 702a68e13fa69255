#pragma once

#include <string>

#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::numbers {

/// A number with so many significant digits, for texts.
std::string number(double value, int digits = 3);

}  // namespace mmradartwin::diagnosis::numbers
