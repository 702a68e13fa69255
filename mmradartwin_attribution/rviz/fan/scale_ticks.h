#pragma once

#include <vector>

namespace mmradartwin {

/// Values of 1, 2 or 5 times a power of ten apart, from `low` to `high`, with 0 among them where it lies between: as
/// many as there can be, up to `most` (2 or more).
std::vector<double> ticks(double low, double high, int most);

}  // namespace mmradartwin
