#include "mmradartwin_dsp/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mmradartwin {
namespace {

TEST(Statistics, MedianOfAnEvenCountIsTheMeanOfTheMiddleTwo) {
  EXPECT_DOUBLE_EQ(2.5, median({4, 1, 3, 2}));
  EXPECT_DOUBLE_EQ(3, median({9, 3, 1}));
  EXPECT_TRUE(std::isnan(median({})));
}

TEST(Statistics, UpperMedianIsOneOfTheValues) {
  EXPECT_DOUBLE_EQ(3, upperMedian({4, 1, 3, 2}));
  EXPECT_DOUBLE_EQ(3, upperMedian({9, 3, 1}));
  EXPECT_TRUE(std::isnan(upperMedian({})));
}

TEST(Statistics, QuantileInterpolatesBetweenOrderStatistics) {
  EXPECT_DOUBLE_EQ(1.75, quantile({4, 1, 3, 2}, 0.25));
  EXPECT_DOUBLE_EQ(4, quantile({4, 1, 3, 2}, 1));
  EXPECT_DOUBLE_EQ(1.75, quantileOfSorted({1, 2, 3, 4}, 0.25));
}

TEST(Statistics, MedianAbsoluteDeviationIgnoresAnOutlier) {
  EXPECT_DOUBLE_EQ(1, medianAbsoluteDeviation({1, 2, 3, 4, 1000}));
}

TEST(Statistics, ShareIntervalHasTheTailsOfTheBinomial) {
  const Interval none = shareInterval(0, 10, 0.95), all = shareInterval(10, 10, 0.95), some = shareInterval(1, 2, 0.95);
  EXPECT_EQ(0, none.low);
  EXPECT_NEAR(1 - std::pow(0.025, 0.1), none.high, 1e-9);  // nobody in ten: (1-p)^10 = 2.5 %
  EXPECT_NEAR(std::pow(0.025, 0.1), all.low, 1e-9);
  EXPECT_EQ(1, all.high);
  EXPECT_NEAR(1 - std::sqrt(0.975), some.low, 1e-9);  // at least one in two: 1-(1-p)^2 = 2.5 %
  EXPECT_NEAR(std::sqrt(0.975), some.high, 1e-9);
  EXPECT_EQ(0, shareInterval(0, 0, 0.95).low);
  EXPECT_EQ(1, shareInterval(0, 0, 0.95).high);
}

}  // namespace
}  // namespace mmradartwin
