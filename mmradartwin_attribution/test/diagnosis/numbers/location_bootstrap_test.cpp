#include "diagnosis/numbers/location_bootstrap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <random>
#include <set>

namespace mmradartwin::diagnosis {
namespace {

double meanOf(const std::vector<double>& values, const std::vector<int>& times) {
  double sum = 0, count = 0;
  for (std::size_t l = 0; l < values.size(); ++l) {
    sum += times[l] * values[l];
    count += times[l];
  }
  return sum / count;
}

TEST(LocationBootstrap, IntervalOfAMeanIsThatOfTheNormalLaw) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(3, 2);
  std::vector<double> values(100);
  for (double& v : values) v = normal(random);
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / 100;
  double variance = 0;
  for (double v : values) variance += (v - mean) * (v - mean) / 100;
  const double half = 1.96 * std::sqrt(variance / 100);
  const auto interval =
      intervalOverLocations(100, [&](const std::vector<int>& times) { return meanOf(values, times); });
  // 1000 draws know a 97.5 % quantile to a tenth of half the interval.
  EXPECT_NEAR(interval[0], mean - half, 0.15 * half);
  EXPECT_NEAR(interval[1], mean + half, 0.15 * half);
}

TEST(LocationBootstrap, DrawsAsManyLocationsAsThereAre) {
  std::mutex guard;
  std::set<std::vector<int>> draws;
  std::size_t calls = 0;
  intervalOverLocations(7, [&](const std::vector<int>& times) {
    const std::lock_guard<std::mutex> lock(guard);
    EXPECT_EQ(times.size(), 7u);
    EXPECT_EQ(std::accumulate(times.begin(), times.end(), 0), 7);
    draws.insert(times);
    ++calls;
    return 0.0;
  });
  EXPECT_EQ(calls, 1000u);
  EXPECT_GT(draws.size(), 400u) << "draws differ from each other";
}

TEST(LocationBootstrap, SaysTheSameEveryTime) {
  const std::vector<double> values{1, 4, 2, 8, 5, 7};
  const auto once = [&] {
    return intervalOverLocations(6, [&](const std::vector<int>& times) { return meanOf(values, times); });
  };
  EXPECT_EQ(once(), once());
}

TEST(LocationBootstrap, LeavesOutDrawsWithoutAnAnswer) {
  // A location is missing in a share (1 - 1/n)^n of the draws: 0.33 of 5. The other statistic needs two of them.
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto intervals = intervalsOverLocations(5, [&](const std::vector<int>& times) {
    return std::vector<double>{times[0] > 0 ? 2.0 : nan, times[0] > 1 ? 2.0 : nan, 1.0 * times[0]};
  });
  ASSERT_EQ(intervals.size(), 3u);
  ASSERT_TRUE(intervals[0]);
  EXPECT_EQ(*intervals[0], (std::array<double, 2>{2, 2}));
  EXPECT_FALSE(intervals[1]) << "nothing said in three quarters of the draws";
  ASSERT_TRUE(intervals[2]);
  EXPECT_EQ((*intervals[2])[0], 0);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
