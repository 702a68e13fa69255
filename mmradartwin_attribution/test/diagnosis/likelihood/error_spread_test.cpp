#include "diagnosis/likelihood/error_spread.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace mmradartwin::diagnosis {
namespace {

/// Errors of a known spread, each measured with an error of its own.
ErrorEvidence measured(int errors, double spread, double measurement, unsigned seed, double outlier = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  ErrorEvidence evidence;
  evidence.information = Eigen::MatrixXd::Zero(errors, errors);
  evidence.weighted.resize(errors);
  for (int i = 0; i < errors; ++i) {
    const double error = i == 0 && outlier != 0 ? outlier : spread * normal(random);
    const double information = 1 / (measurement * measurement);
    evidence.information(i, i) = information;
    evidence.weighted[i] = information * (error + measurement * normal(random));
  }
  return evidence;
}

TEST(ErrorSpread, IsFoundWhateverWasStated) {
  for (const double stated : {0.1, 1.0, 4.0}) {
    double mean = 0;
    int holds = 0;
    const int draws = 60;
    for (int i = 0; i < draws; ++i) {
      const auto found = estimatedSpread(measured(20, 1.0, 0.2, static_cast<unsigned>(i)), stated);
      ASSERT_TRUE(found);
      mean += std::log(found->value) / draws;
      holds += found->low < 1 && found->high > 1 ? 1 : 0;
    }
    EXPECT_NEAR(std::exp(mean), 1.0, 0.15) << "stated " << stated;
    EXPECT_GE(holds, draws * 85 / 100) << "stated " << stated;
  }
}

TEST(ErrorSpread, IsNotStretchedByOneOutlier) {
  double mean = 0;
  for (unsigned i = 0; i < 30; ++i) mean += estimatedSpread(measured(20, 1.0, 0.2, i, 15.0), 1.0)->value / 30;
  EXPECT_NEAR(mean, 1.0, 0.2);
}

TEST(ErrorSpread, IsNotStretchedByWhatAllErrorsShare) {
  ErrorEvidence evidence = measured(24, 0.5, 0.2, 7);
  evidence.weighted += evidence.information * Eigen::VectorXd::Constant(24, 6.0);
  EXPECT_GT(estimatedSpread(evidence, 0.5)->value, 3);
  evidence.leaveOutCommon();
  EXPECT_NEAR(estimatedSpread(evidence, 0.5)->value, 0.5, 0.15);
}

TEST(ErrorSpread, OfErrorsThatNothingMeasuresIsNotTold) {
  EXPECT_FALSE(estimatedSpread(measured(20, 1.0, 100.0, 1), 1.0));
  ErrorEvidence nothing;
  nothing.information = Eigen::MatrixXd::Zero(5, 5);
  nothing.weighted = Eigen::VectorXd::Zero(5);
  EXPECT_FALSE(estimatedSpread(nothing, 1.0));
}

TEST(ErrorSpread, LeavesOutWhatAllErrorsShare) {
  // The mean of all errors is not known (a gain takes it): the information has no part along it.
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 1);
  const int errors = 24;
  Eigen::VectorXd values(errors);
  for (double& v : values) v = 5 + 0.5 * normal(random);
  ErrorEvidence evidence;
  evidence.information =
      100 * (Eigen::MatrixXd::Identity(errors, errors) - Eigen::MatrixXd::Constant(errors, errors, 1.0 / errors));
  evidence.weighted = evidence.information * values;
  const auto found = estimatedSpread(evidence, 1.0);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->value, 0.5, 0.15);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
