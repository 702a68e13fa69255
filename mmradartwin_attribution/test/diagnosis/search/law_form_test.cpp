#include "diagnosis/search/law_form.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace mmradartwin::diagnosis {
namespace {

std::vector<double> evenly(double from, double to, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(from + (to - from) * i / (count - 1));
  return values;
}

/// A form's value at x with these numbers, by linear interpolation of its own table.
double valueAt(const LawForm& form, const Eigen::VectorXd& numbers, double x) {
  const Eigen::VectorXd table = form.shapes * numbers;
  const auto above = std::upper_bound(form.at.begin(), form.at.end(), x);
  if (above == form.at.begin()) return table[0];
  if (above == form.at.end()) return table[table.size() - 1];
  const auto i = above - form.at.begin();
  const double low = form.at[static_cast<std::size_t>(i - 1)], share = (x - low) / (*above - low);
  return (1 - share) * table[i - 1] + share * table[i];
}

TEST(LawForms, WeightsOfTheFinestTableAreLinearBetweenNodes) {
  const LawForms forms("amplitude_db", evenly(-30, 0, 100), true);
  const std::vector<double>& fine = forms.fine();
  for (double x : {-29.3, -12.34, -0.1, -30.0, 0.0}) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(fine.size()));
    forms.addAt(x, 2, row);
    EXPECT_NEAR(row.sum(), 2, 1e-12);
    EXPECT_NEAR(row.dot(Eigen::Map<const Eigen::RowVectorXd>(fine.data(), row.size())), 2 * x, 1e-9);
  }
  Eigen::RowVectorXd beyond = Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(fine.size()));
  forms.addAt(7, 1, beyond);
  EXPECT_EQ(beyond[beyond.size() - 1], 1);
}

TEST(LawForms, RangesOfAHallHaveAFinerTable) {
  EXPECT_EQ(LawForms("range_m", evenly(1, 6, 50), true).fine().size(), 48U);
  EXPECT_EQ(LawForms("range_m", evenly(1, 21, 50), true).fine().size(), 100U);
  EXPECT_EQ(LawForms("range_m", evenly(1, 90, 50), true).fine().size(), 128U);
}

TEST(LawForms, NothingVariesWhereAllValuesAreTheSame) {
  EXPECT_FALSE(LawForms("range_m", {3, 3, 3.0001}, true).varies());
  EXPECT_TRUE(LawForms("range_m", {3, 3, 3.1}, true).varies());
}

TEST(LawForms, CurvesAreFreeAtEachOfTheirPoints) {
  const LawForms forms("amplitude_db", evenly(-40, 0, 401), true);
  const std::vector<LawForm> curves = forms.curves();
  ASSERT_EQ(curves.size(), 7U);  // of two points to eight
  for (const LawForm& curve : curves) {
    EXPECT_TRUE(curve.of_points);
    EXPECT_EQ(curve.shapes.cols(), static_cast<Eigen::Index>(curve.at.size()));
    const Eigen::VectorXd numbers = Eigen::VectorXd::LinSpaced(curve.shapes.cols(), 3, -5);
    for (std::size_t i = 0; i < curve.at.size(); ++i) {
      EXPECT_NEAR(valueAt(curve, numbers, curve.at[i]), numbers[static_cast<Eigen::Index>(i)], 1e-12);
    }
    EXPECT_EQ(curve.priced(true), static_cast<int>(curve.at.size()) - 1);  // a constant is free
  }
}

TEST(LawForms, ACurveWithoutItsConstantBeginsAtNothing) {
  for (const LawForm& curve : LawForms("amplitude_db", evenly(-40, 0, 401), false).curves()) {
    EXPECT_EQ(curve.shapes.row(0).norm(), 0);
    EXPECT_EQ(curve.priced(false), static_cast<int>(curve.at.size()) - 1);
  }
}

TEST(LawForms, CurvesOverHeadingsCloseTheirCircle) {
  for (const LawForm& curve : LawForms("heading_deg", evenly(-170, 170, 99), true).curves()) {
    EXPECT_EQ(curve.at.front(), -180);
    EXPECT_EQ(curve.at.back(), 180);
    const Eigen::VectorXd numbers = Eigen::VectorXd::LinSpaced(curve.shapes.cols(), -1, 4);
    EXPECT_NEAR(valueAt(curve, numbers, -180), valueAt(curve, numbers, 180), 1e-12);
  }
}

TEST(LawForms, ACoarseCurveOnTheFinestTableIsItself) {
  const LawForms forms("amplitude_db", evenly(-40, 0, 401), true);
  const LawForm curve = forms.curves()[3];
  const Eigen::MatrixXd fine = forms.onFine(curve);
  const Eigen::VectorXd numbers = Eigen::VectorXd::LinSpaced(curve.shapes.cols(), 0, 7).array().sin();
  for (std::size_t i = 0; i < forms.fine().size(); ++i) {
    EXPECT_NEAR(fine.row(static_cast<Eigen::Index>(i)).dot(numbers), valueAt(curve, numbers, forms.fine()[i]), 1e-9);
  }
}

TEST(LawForms, RipplesAreWavesOfTheirPeriod) {
  const LawForms forms("range_m", evenly(1, 7, 200), true);
  int ripples = 0;
  for (const LawForm& form : forms.others()) {
    if (form.words.rfind("a ripple of period ", 0) != 0) continue;
    ++ripples;
    const double period_m = std::stod(form.words.substr(19));
    ASSERT_EQ(form.shapes.cols(), 3);  // the constant, cosine and sine
    EXPECT_EQ(form.priced(true), 3);   // both and the period
    for (std::size_t i = 0; i < form.at.size(); ++i) {
      const Eigen::Index row = static_cast<Eigen::Index>(i);
      // The words have three digits.
      EXPECT_NEAR(form.shapes(row, 1), std::cos(2 * M_PI * form.at[i] / period_m), 0.2);
      EXPECT_NEAR(form.shapes(row, 1) * form.shapes(row, 1) + form.shapes(row, 2) * form.shapes(row, 2), 1, 1e-9);
    }
  }
  EXPECT_GT(ripples, 10);
}

TEST(LawForms, RipplesOverAzimuthAreInTheSineToo) {
  bool of_sine = false;
  for (const LawForm& form : LawForms("azimuth_deg", evenly(-60, 60, 121), true).others()) {
    of_sine = of_sine || form.words.find("of the sine") != std::string::npos;
  }
  EXPECT_TRUE(of_sine);
}

TEST(LawForms, SectorsAndBumpsAreNothingOutside) {
  const LawForms forms("time_s", evenly(0, 480, 200), false);
  std::size_t local = 0;
  for (const LawForm& form : forms.others()) {
    if (!form.local) continue;
    ++local;
    ASSERT_EQ(form.shapes.cols(), 1);
    const std::size_t from = form.words.find("from ") + 5;
    const double low = std::stod(form.words.substr(from)),
                 high = std::stod(form.words.substr(form.words.find(" to ") + 4));
    for (std::size_t i = 0; i < form.at.size(); ++i) {
      const double value = form.shapes(static_cast<Eigen::Index>(i), 0);
      if (form.at[i] < 0.99 * low - 1 || form.at[i] > 1.01 * high + 1) {
        EXPECT_EQ(value, 0) << form.words;
      }
      EXPECT_GE(value, 0);
      EXPECT_LE(value, 1);
    }
    // One edge that was looked for where it reaches to an end, else two.
    EXPECT_EQ(form.searched, low <= 1 || high >= 479 ? 1 : 2) << form.words;
  }
  EXPECT_GT(local, 300U);
}

TEST(LawForms, ExponentialsFallByEInTheirSpan) {
  const LawForms forms("time_s", evenly(0, 100, 200), false);
  int seen = 0;
  for (const LawForm& form : forms.others()) {
    const bool falls = form.words.rfind("an exponential that falls by e in ", 0) == 0;
    const bool grows = form.words.rfind("an exponential that grows by e in ", 0) == 0;
    if (!falls && !grows) continue;
    ++seen;
    const double span_s = std::stod(form.words.substr(34));
    for (std::size_t i = 0; i < form.at.size(); ++i) {
      const double along_s = falls ? form.at[i] : 100 - form.at[i];
      EXPECT_NEAR(form.shapes(static_cast<Eigen::Index>(i), 0), std::exp(-along_s / span_s), 1e-9);
    }
  }
  EXPECT_EQ(seen, 8);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
