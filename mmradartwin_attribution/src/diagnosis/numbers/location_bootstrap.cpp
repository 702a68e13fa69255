#include "diagnosis/numbers/location_bootstrap.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <random>

#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin::diagnosis::numbers {
namespace {

constexpr std::size_t kDraws = 1000;  ///< of locations; a 2.5 % quantile is then good to some percent of the interval

}  // namespace

std::vector<std::optional<std::array<double, 2>>> intervalsOverLocations(
    std::size_t locations, const std::function<std::vector<double>(const std::vector<int>&)>& statistics) {
  std::mt19937 random(1);
  std::vector<std::vector<int>> times(kDraws, std::vector<int>(locations, 0));
  for (std::vector<int>& drawn : times) {
    for (std::size_t l = 0; l < locations; ++l) ++drawn[random() % locations];
  }
  std::vector<std::vector<double>> values(kDraws);
  tbb::parallel_for(std::size_t{0}, kDraws, [&](std::size_t i) { values[i] = statistics(times[i]); });
  std::vector<std::optional<std::array<double, 2>>> intervals(values.front().size());
  for (std::size_t k = 0; k < intervals.size(); ++k) {
    std::vector<double> numbers;
    for (const std::vector<double>& draw : values) {
      if (!std::isnan(draw[k])) numbers.push_back(draw[k]);
    }
    if (2 * numbers.size() < kDraws) continue;
    intervals[k] = {quantile(numbers, 0.025), quantile(numbers, 0.975)};
  }
  return intervals;
}

std::array<double, 2> intervalOverLocations(std::size_t locations,
                                            const std::function<double(const std::vector<int>&)>& statistic) {
  return intervalsOverLocations(locations,
                                [&](const std::vector<int>& times) { return std::vector<double>{statistic(times)}; })
      .front()
      .value();
}

}  // namespace mmradartwin::diagnosis::numbers
