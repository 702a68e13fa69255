#pragma once

#include <vector>

namespace mmradartwin {

/// Variance that rounding to whole numbers adds to a real number.
constexpr double kRoundingVariance = 1.0 / 12;

/// Quantile by linear interpolation between order statistics; NaN for an empty list. `probability` is in [0, 1].
double quantile(std::vector<double> values, double probability);
/// The same of a list in ascending order.
double quantileOfSorted(const std::vector<double>& values, double probability);
/// Middle value, the mean of the two middle ones in an even count; NaN for an empty list.
double median(std::vector<double> values);
/// Middle value, the greater of the two middle ones in an even count: always one of the values. NaN for an empty list.
double upperMedian(std::vector<double> values);
/// Median of the distances from the median; NaN for an empty list.
double medianAbsoluteDeviation(const std::vector<double>& values);

struct Interval {
  double low = 0, high = 0;
};
/// Clopper-Pearson interval of a share: `hits` of `trials` at this confidence, (0, 1). No trial: [0, 1].
Interval shareInterval(int hits, int trials, double confidence);

}  // namespace mmradartwin
