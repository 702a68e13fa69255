#include "diagnosis/likelihood/bounded_step.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

namespace mmradartwin::diagnosis::likelihood {
namespace {

double quadratic(const Eigen::MatrixXd& information, const Eigen::VectorXd& score, const Eigen::VectorXd& d) {
  return score.dot(d) - 0.5 * d.dot(information * d);
}

TEST(BoundedStep, IsNewtonsWithinItsBounds) {
  Eigen::Matrix2d information;
  information << 4, 1, 1, 2;
  const Eigen::Vector2d score(1, -2), wide(9, 9);
  const BoundedStep found = boundedStep(information, score, -wide, wide);
  const Eigen::Vector2d newton = information.ldlt().solve(score);
  EXPECT_NEAR((found.step - newton).norm(), 0, 1e-12);
  EXPECT_NEAR(found.promised_nats, 0.5 * score.dot(newton), 1e-12);
}

TEST(BoundedStep, StaysOnTheRidgeOfCoupledNumbers) {
  // Two numbers of which only the difference is known well, and whose sum would rise by 10.
  Eigen::Matrix2d information;
  information << 1000.01, -999.99, -999.99, 1000.01;
  const Eigen::Vector2d score = information * Eigen::Vector2d(5, 5), high(0.1, 9);
  const BoundedStep found = boundedStep(information, score, -high, high);
  EXPECT_DOUBLE_EQ(found.step[0], 0.1);
  EXPECT_NEAR(found.step[1], (score[1] + 999.99 * 0.1) / 1000.01, 1e-12);
  EXPECT_GT(found.promised_nats, 0);
  EXPECT_LT(quadratic(information, score, Eigen::Vector2d(0.1, 5)), 0) << "a step that is cut in one number only";
}

TEST(BoundedStep, IsTheMaximumWithinTheBounds) {
  // At the maximum of a concave function over a box no slope leads inwards or along a number that is free.
  std::mt19937 random(20261130);
  std::normal_distribution<double> normal(0, 1);
  int at_bounds = 0;
  for (int draw = 0; draw < 200; ++draw) {
    const Eigen::Index n = 8;
    const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(n, n, [&](Eigen::Index) { return normal(random); });
    const Eigen::MatrixXd information = root * root.transpose() + 0.01 * Eigen::MatrixXd::Identity(n, n);
    const Eigen::VectorXd score = Eigen::VectorXd::NullaryExpr(n, [&](Eigen::Index) { return 3 * normal(random); });
    const Eigen::VectorXd high =
        Eigen::VectorXd::NullaryExpr(n, [&](Eigen::Index) { return std::abs(normal(random)); });
    const BoundedStep found = boundedStep(information, score, -high, high);
    const Eigen::VectorXd slope = score - information * found.step;
    for (Eigen::Index j = 0; j < n; ++j) {
      ASSERT_LE(std::abs(found.step[j]), high[j]) << "draw " << draw;
      const bool above = found.step[j] == high[j], below = found.step[j] == -high[j];
      at_bounds += above || below ? 1 : 0;
      if (!below) EXPECT_GE(slope[j], -1e-4) << "draw " << draw;
      if (!above) EXPECT_LE(slope[j], 1e-4) << "draw " << draw;
    }
    EXPECT_NEAR(found.promised_nats, quadratic(information, score, found.step), 1e-9);
  }
  EXPECT_GT(at_bounds, 200);
}

}  // namespace
}  // namespace mmradartwin::diagnosis::likelihood
