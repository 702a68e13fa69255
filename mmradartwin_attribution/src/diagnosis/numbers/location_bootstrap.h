#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::numbers {

/// 95 % intervals of statistics by the bootstrap over locations: percentiles of 1000 draws with replacement, which are
/// the same in every call. `statistics` takes how often each location was drawn and returns the same number of values
/// each time; it is called from several threads at once. An interval leaves out draws in which its statistic is NaN,
/// and is empty where these are more than half.
std::vector<std::optional<std::array<double, 2>>> intervalsOverLocations(
    std::size_t locations, const std::function<std::vector<double>(const std::vector<int>&)>& statistics);

/// 95 % interval of one statistic that is never NaN.
std::array<double, 2> intervalOverLocations(std::size_t locations,
                                            const std::function<double(const std::vector<int>&)>& statistic);

}  // namespace mmradartwin::diagnosis::numbers
