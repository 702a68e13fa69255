#include "diagnosis/likelihood/echo_level.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace mmradartwin::diagnosis {
namespace {

constexpr int kChannels = 8;
using Vector = Eigen::VectorXcd;
using Matrix = Eigen::MatrixXcd;

double powerOf(double db) { return std::pow(10, db / 10); }

PackedHermitian packed(const Matrix& m) {
  PackedHermitian p(static_cast<int>(m.rows()));
  std::size_t i = 0;
  for (int k = 0; k < m.rows(); ++k) {
    for (int l = 0; l <= k; ++l, ++i) {
      p.re[i] = m(k, l).real();
      p.im[i] = m(k, l).imag();
    }
  }
  return p;
}

/// Cell with one echo of power 1 in all channels over clutter and noise.
struct Cell {
  double echo = 1, clutter = powerOf(-35), noise = powerOf(-60), spread_db = 1.5;
  double turn_rad = 0;  ///< phase from one channel to the next
  Vector direction() const {
    Vector s(kChannels);
    for (int k = 0; k < kChannels; ++k) s[k] = std::polar(1.0, k * turn_rad);
    return s;
  }
  Matrix covariance() const {
    return echo * direction() * direction().adjoint() + (clutter + noise) * Matrix::Identity(kChannels, kChannels);
  }
  CellEcho expected() const {
    CellEcho e;
    e.power = echo;
    e.spread = std::pow(spread_db / 4.343, 2);
    const Vector s = direction();
    std::copy(s.begin(), s.end(), e.direction.begin());
    return e;
  }
  double logLikelihood(const Vector& y) const {
    InverseFactor factor;
    EXPECT_TRUE(factor.compute(packed(covariance())));
    Vector z(kChannels);
    factor.apply(y.data(), z.data());
    return CellLikelihood(factor, z.data(), expected()).logLikelihood();
  }
};

/// Measured cells: phase uniform, level normal in dB about level_db, clutter normal.
std::vector<Vector> measured(int count, double level_db, double spread_db, double clutter_db) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> turn(0, 2 * M_PI);
  const double floor = std::sqrt((powerOf(clutter_db) + powerOf(-60)) / 2);
  std::vector<Vector> all;
  for (int i = 0; i < count; ++i) {
    const std::complex<double> echo =
        std::polar(std::pow(10, (level_db + spread_db * normal(random)) / 20), turn(random));
    Vector y(kChannels);
    for (int k = 0; k < kChannels; ++k) y[k] = echo + floor * std::complex<double>(normal(random), normal(random));
    all.push_back(y);
  }
  return all;
}

double sum(const std::vector<Vector>& cells, const Cell& model) {
  double total = 0;
  for (const Vector& y : cells) total += model.logLikelihood(y);
  return total;
}

/// Level in dB at which measured cells are likeliest.
double likeliestLevel_db(const std::vector<Vector>& cells, double spread_db) {
  double best = -1e300, at = 0;
  for (double db = -10; db <= 10; db += 0.05) {
    Cell model;
    model.echo = powerOf(db);
    model.spread_db = spread_db;
    const double value = sum(cells, model);
    if (value > best) {
      best = value;
      at = db;
    }
  }
  return at;
}

TEST(EchoLevel, IsNotMovedByAFloorOfAnotherLevel) {
  for (double off_db : {-10.0, -5.0, 0.0, 5.0, 10.0}) {
    EXPECT_NEAR(likeliestLevel_db(measured(2000, 0, 0.5, -35 + off_db), 0.5), 0, 0.1) << off_db;
  }
}

TEST(EchoLevel, IsNoLikelierWhereItVanishesHoweverLittleIsKnown) {
  // Channels in which nothing lies along the echo, against channels that hold the expected echo. Clutter alone is
  // likelier by what it lacks across the echo, which is the same in both.
  Cell model;
  model.turn_rad = 0.4;
  Vector across = Vector::Zero(kChannels);
  across[0] = std::sqrt(powerOf(-35));
  across -= model.direction() * (model.direction().dot(across) / static_cast<double>(kChannels));
  for (double spread_db : {1.5, 5.0, 8.0, 15.0, 30.0}) {
    model.spread_db = spread_db;
    const double there = model.logLikelihood(across + model.direction());
    for (double db : {-60.0, -80.0, -100.0}) {
      const double vanished = model.logLikelihood(across + model.direction() * std::pow(10, db / 20));
      EXPECT_LT(vanished, there + 1.5) << spread_db << " dB of spread, " << db << " dB";
    }
  }
}

TEST(EchoLevel, IsKnownByItsSpread) {
  // Curvature of the log-likelihood by the common level of many echoes, per echo: 1 / spread^2, less the share of
  // echoes whose level is not known.
  for (double spread_db : {0.5, 1.5}) {
    const std::vector<Vector> cells = measured(4000, 0, spread_db, -35);
    const auto at = [&](double db) {
      Cell model;
      model.echo = powerOf(db);
      model.spread_db = spread_db;
      return sum(cells, model);
    };
    const double step = 0.3 * spread_db;
    const double information = -(at(step) - 2 * at(0) + at(-step)) / (step * step) / 4000;
    EXPECT_NEAR(information * spread_db * spread_db, 0.92, 0.15) << spread_db;
  }
}

TEST(EchoLevel, HasTheSpreadOfLevelsThatScatterNormally) {
  for (double spread_db : {0.5, 1.5}) {
    const std::vector<Vector> cells = measured(2000, 0, spread_db, -35);
    double best = -1e300, at = 0;
    for (double factor = 0.7; factor < 1.4; factor += 0.05) {
      Cell model;
      model.spread_db = factor * spread_db;
      const double value = sum(cells, model);
      if (value <= best) continue;
      best = value;
      at = factor;
    }
    EXPECT_NEAR(at, 1, 0.08) << spread_db << " dB";
  }
}

TEST(EchoLevel, TellsWeakEffects) {
  // Nats of ten echoes for the truth over none; the exponential of fading gave 1.6 for -3 dB at 1.5 dB.
  const auto nats = [](double effect_db, double spread_db) {
    const std::vector<Vector> cells = measured(1000, effect_db, spread_db, -35);
    Cell truth, none;
    truth.echo = powerOf(effect_db);
    truth.spread_db = none.spread_db = spread_db;
    return (sum(cells, truth) - sum(cells, none)) / 100;
  };
  EXPECT_GT(nats(-1, 0.5), 12);
  EXPECT_GT(nats(-1, 1.5), 1.5);
  EXPECT_GT(nats(-3, 1.5), 14);
}

TEST(EchoLevel, FadesWhereNoEchoStandsOut) {
  // Without an echo it is the complex t distribution alone.
  const std::vector<Vector> cells = measured(20, -60, 0, -35);
  for (const Vector& y : cells) {
    const Matrix covariance = powerOf(-35) * Matrix::Identity(kChannels, kChannels);
    InverseFactor factor;
    ASSERT_TRUE(factor.compute(packed(covariance)));
    Vector z(kChannels);
    factor.apply(y.data(), z.data());
    const double q = y.squaredNorm() / powerOf(-35);
    EXPECT_NEAR(CellLikelihood(factor, z.data(), CellEcho()).logLikelihood(),
                -kChannels * std::log(powerOf(-35)) - (kChannels + 4) * std::log1p(q / 4), 1e-6);
  }
}

TEST(EchoLevel, AHiddenEchoIsTheSameCellWithLittleOfItsPower) {
  for (const double there_db : {0.0, -25.0, -60.0}) {
    const Vector y = measured(1, there_db, 0, -35).front();
    const Cell cell;
    InverseFactor factor;
    ASSERT_TRUE(factor.compute(packed(cell.covariance())));
    Vector z(kChannels);
    factor.apply(y.data(), z.data());
    double mean = 0;
    for (const double left : {0.0, 1e-4, 1e-3, 1e-2}) {
      Cell hidden;
      hidden.echo = left;
      const Matrix covariance = hidden.covariance();
      const double q = y.dot(covariance.inverse() * y).real();
      mean += 0.25 * std::exp(-std::log(std::abs(covariance.determinant())) - (kChannels + 4) * std::log1p(q / 4) - 50);
    }
    const double expected = std::log(mean) + 50;
    EXPECT_NEAR(CellLikelihood(factor, z.data(), cell.expected()).withoutEcho(), expected, 1e-3) << there_db;
    // Where the echo is there it is likelier with it; where it is hidden, without.
    EXPECT_EQ(cell.logLikelihood(y) > expected, there_db == 0.0) << there_db;
  }
}

/// Score of a change of the covariance of a cell, and the slope of the log-likelihood along it, the model's echo going
/// along.
void expectSlope(const Vector& y, const std::function<Cell(double)>& at) {
  const double step = 1e-4;
  const double slope = (at(step).logLikelihood(y) - at(-step).logLikelihood(y)) / (2 * step);
  const Matrix change = (at(step).covariance() - at(-step).covariance()) / (2 * step);
  InverseFactor factor;
  ASSERT_TRUE(factor.compute(packed(at(0).covariance())));
  Vector z(kChannels);
  factor.apply(y.data(), z.data());
  Eigen::VectorXd score(kChannels * kChannels), whitened(kChannels * kChannels);
  CellLikelihood(factor, z.data(), at(0).expected()).score(score.data());
  factor.whiten(packed(change), whitened.data());
  EXPECT_NEAR(score.dot(whitened), slope, 0.02 * std::abs(slope) + 0.05);
}

TEST(EchoLevel, ScoresAreSlopes) {
  for (const Vector& y : measured(12, 1, 1.5, -35)) {
    expectSlope(y, [](double by) {
      Cell cell;
      cell.echo = std::exp(by);
      return cell;
    });
    expectSlope(y, [](double by) {
      Cell cell;
      cell.clutter *= std::exp(by);
      return cell;
    });
    expectSlope(y, [](double by) {
      Cell cell;
      cell.turn_rad = 0.01 + by;
      return cell;
    });
  }
}

TEST(EchoLevel, ScoresTheSpread) {
  const std::vector<Vector> cells = measured(12, 1, 1.5, -35);
  for (const Vector& y : cells) {
    const auto likelihood = [&](double log_spread) {
      Cell cell;
      InverseFactor factor;
      EXPECT_TRUE(factor.compute(packed(cell.covariance())));
      Vector z(kChannels);
      factor.apply(y.data(), z.data());
      CellEcho echo = cell.expected();
      echo.spread = std::exp(log_spread);
      return CellLikelihood(factor, z.data(), echo);
    };
    const double slope = (likelihood(-2 + 1e-4).logLikelihood() - likelihood(-2 - 1e-4).logLikelihood()) / 2e-4;
    EXPECT_NEAR(likelihood(-2).spreadScore(), slope, 0.01 * std::abs(slope) + 0.01);
  }
}

}  // namespace
}  // namespace mmradartwin::diagnosis
