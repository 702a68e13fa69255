#include "diagnosis/likelihood/profiled_scores.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <random>

namespace mmradartwin::diagnosis {
namespace {

/// Scores of `globals` shared numbers and `n` coordinates at `locations` places, drawn.
Scores drawnScores(int globals, int n, int locations) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0, 1);
  const auto draw = [&](int rows, int columns) {
    Eigen::MatrixXd m(rows, columns);
    for (double& v : m.reshaped()) v = normal(random);
    return m;
  };
  Scores s;
  const Eigen::MatrixXd root = draw(globals + n + 5, globals + n);
  s.information = root.transpose() * root;
  s.by_location = draw(locations, globals + n);
  s.total = s.by_location.colwise().sum().transpose();
  s.prior = Eigen::VectorXd::Constant(globals, 0.7);
  return s;
}

TEST(ProfiledScores, InformationIsThatOfTheInverseOfAll) {
  const int globals = 4, n = 3;
  const Scores s = drawnScores(globals, n, 6);
  const ProfiledScores e = profiledScores(s, globals);
  const Eigen::MatrixXd covariance = s.information.inverse().bottomRightCorner(n, n);
  EXPECT_LT((e.information - covariance.inverse()).norm(), 1e-6 * e.information.norm());
  // The step of the coordinates is that of a joint step of all numbers.
  const Eigen::VectorXd joint = s.information.ldlt().solve(s.total);
  EXPECT_LT((e.information.ldlt().solve(e.total) - joint.tail(n)).norm(), 1e-6 * joint.norm());
  EXPECT_LT((e.by_location.colwise().sum().transpose() - e.total).norm(), 1e-9);
}

TEST(ProfiledScores, ScatterIsThatOverPlacesAndOfThePriors) {
  const int globals = 2, n = 1, locations = 5;
  const Scores s = drawnScores(globals, n, locations);
  const ProfiledScores e = profiledScores(s, globals);
  const Eigen::VectorXd projection =
      s.information.topLeftCorner(globals, globals).inverse() * s.information.topRightCorner(globals, n);
  double mean = 0, squares = 0;
  std::vector<double> at;
  for (int l = 0; l < locations; ++l) {
    at.push_back(s.by_location(l, globals) - s.by_location.row(l).head(globals).dot(projection));
    mean += at.back() / locations;
  }
  for (double v : at) squares += (v - mean) * (v - mean);
  const double want = squares * locations / (locations - 1) + 0.7 * projection.squaredNorm();
  EXPECT_NEAR(e.scatter(0, 0), want, 1e-9 * want);
  EXPECT_NEAR(e.overdispersion, std::min(want / e.information(0, 0), kMostOverdispersion), 1e-6 * e.overdispersion);
}

TEST(ProfiledScores, OnePlaceShowsNoScatter) {
  const ProfiledScores e = profiledScores(drawnScores(2, 2, 1), 2);
  EXPECT_EQ(e.overdispersion, 1);
  EXPECT_EQ(e.scatter.size(), 0);
}

TEST(Overdispersion, IsOneOfAGainThatScattersAsChanceHasIt) {
  // Of a quadratic likelihood with slope s_l at place l, the gain is (sum s)^2 / (2 I) and each place's share scatters
  // with the variance 2 G / L for I = L.
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0, 1);
  const int locations = 4000;
  const double gain = 300;
  std::vector<double> by_location;
  for (int l = 0; l < locations; ++l)
    by_location.push_back(gain / locations + std::sqrt(2 * gain / locations) * normal(random));
  EXPECT_NEAR(overdispersionOf(gain, by_location), 1, 0.05);
  for (double& v : by_location) v *= 3;
  EXPECT_NEAR(overdispersionOf(gain, by_location), 9, 0.5);
}

TEST(Overdispersion, IsNeverBelowOneNorBeyondTheMost) {
  EXPECT_EQ(overdispersionOf(10, {5, 5}), 1);
  EXPECT_EQ(overdispersionOf(1, {100, -99}), kMostOverdispersion);
  EXPECT_EQ(overdispersionOf(-3, {5, -8}), 1);
  EXPECT_EQ(overdispersionOf(7, {7}), 1);
}

TEST(Overdispersion, OfPresenceCountsPlacesThatLoseAlone) {
  EXPECT_EQ(overdispersionOfPresence(10, {0, 0, 10}), 1);
  EXPECT_DOUBLE_EQ(overdispersionOfPresence(10, {-4, -2, 16}), 2);
  EXPECT_EQ(overdispersionOfPresence(10, {10}), 1);
}

TEST(Difference, IsTheChangePerStep) {
  const SessionCovariance ahead = {{{5, 1}, {2, 0}}}, behind = {{{1, 1}, {4, 2}}},
                          all = {{{9, 9}, {9, 9}}, {{1, 0}, {0, 1}}};
  const SessionCovariance two_sided = difference(ahead, behind, 2);
  EXPECT_EQ(two_sided[0][0], std::complex<float>(2, 0));
  EXPECT_EQ(two_sided[0][1], std::complex<float>(-1, -1));
  const SessionCovariance from_second = difference(ahead, all, {1}, 0.5);
  EXPECT_EQ(from_second[0][0], std::complex<float>(8, 2));
  EXPECT_EQ(from_second[0][1], std::complex<float>(4, -2));
}

TEST(Latents, WithoutErrorsOfOneActorKeepThoseOfOthers) {
  SessionLatents latents;
  latents.actor_gain = {0.1, 0.2, 0.3};
  latents.actor_range_m = {0.01, 0.02, 0.03};
  const SessionLatents freed = withoutErrors(latents, 1);
  EXPECT_EQ(freed.actor_gain, (std::vector<double>{0.1, 0, 0.3}));
  EXPECT_EQ(freed.actor_range_m, (std::vector<double>{0.01, 0, 0.03}));
}

TEST(Regularised, CanBeSolvedWhereADirectionDoesNothing) {
  const Eigen::Matrix2d information = Eigen::Vector2d(4, 0).asDiagonal();
  const Eigen::Vector2d step = regularised(information).ldlt().solve(Eigen::Vector2d(8, 0));
  EXPECT_NEAR(step[0], 2, 1e-6);
  EXPECT_EQ(step[1], 0);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
