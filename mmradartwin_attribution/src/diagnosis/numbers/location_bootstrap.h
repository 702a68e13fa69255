#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::numbers {

/// 95 % intervals of statistics over locations drawn with replacement (percentiles of 1000 draws, the same ones every
/// time). `statistics` gets how often each location was drawn and gives as many numbers each time; called from several
/// threads at once. Nothing for a statistic that is NaN in more than half of the draws; others are left out of it.
std::vector<std::optional<std::array<double, 2>>> intervalsOverLocations(
    std::size_t locations, const std::function<std::vector<double>(const std::vector<int>&)>& statistics);

/// The same of one statistic that is never NaN.
std::array<double, 2> intervalOverLocations(std::size_t locations,
                                            const std::function<double(const std::vector<int>&)>& statistic);

}  // namespace mmradartwin::diagnosis::numbers
