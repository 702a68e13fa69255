#include "mmradartwin_dsp/statistics.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace mmradartwin {

double quantileOfSorted(const std::vector<double>& values, double probability) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double position = probability * static_cast<double>(values.size() - 1);
  const std::size_t below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (position - static_cast<double>(below)) * (values[above] - values[below]);
}

double quantile(std::vector<double> values, double probability) {
  std::sort(values.begin(), values.end());
  return quantileOfSorted(values, probability);
}

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

double upperMedian(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double medianAbsoluteDeviation(const std::vector<double>& values) {
  const double middle = median(values);
  std::vector<double> apart;
  apart.reserve(values.size());
  for (double value : values) apart.push_back(std::abs(value - middle));
  return median(std::move(apart));
}

Interval shareInterval(int hits, int trials, double confidence) {
  if (trials <= 0) return {0, 1};
  using Binomial = boost::math::binomial_distribution<double>;
  const double tail = (1 - confidence) / 2;
  return {Binomial::find_lower_bound_on_p(trials, hits, tail), Binomial::find_upper_bound_on_p(trials, hits, tail)};
}

}  // namespace mmradartwin
