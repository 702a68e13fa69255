#include "scale_ticks.h"

#include <cmath>

namespace mmradartwin {

std::vector<double> ticks(double low, double high, int most) {
  if (!(high > low) || !std::isfinite(high - low)) return {};
  constexpr double kHair = 1e-9;
  double decade = std::pow(10, std::floor(std::log10((high - low) / most)));
  for (;; decade *= 10) {
    for (double factor : {1, 2, 5}) {
      const double step = factor * decade;
      const double first = std::ceil(low / step - kHair), last = std::floor(high / step + kHair);
      if (last - first + 1 > most) continue;
      std::vector<double> values;
      for (double i = first; i <= last; ++i) values.push_back(i * step);
      return values;
    }
  }
}

}  // namespace mmradartwin
