#include "diagnosis/numbers/packed_hermitian.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <random>

namespace mmradartwin::diagnosis {
namespace {

using Complex = std::complex<double>;
using Field = std::vector<std::complex<float>>;

/// Matrices drawn at random, once as Eigen has them and once packed. 8 channels take a path of their own.
class PackedHermitianTest : public ::testing::TestWithParam<int> {
 protected:
  Eigen::VectorXcd drawVector() {
    return Eigen::VectorXcd::NullaryExpr(GetParam(), [&] { return Complex(normal_(random_), normal_(random_)); });
  }
  Eigen::MatrixXcd drawHermitian() {
    Eigen::MatrixXcd a(GetParam(), GetParam());
    for (Complex& v : a.reshaped()) v = Complex(normal_(random_), normal_(random_));
    return a + a.adjoint();
  }
  Eigen::MatrixXcd drawDefinite() {
    const Eigen::MatrixXcd a = drawHermitian();
    return a * a.adjoint() + 0.1 * Eigen::MatrixXcd::Identity(a.rows(), a.rows());
  }
  static PackedHermitian pack(const Eigen::MatrixXcd& a) {
    PackedHermitian packed(static_cast<int>(a.rows()));
    std::size_t i = 0;
    for (Eigen::Index k = 0; k < a.rows(); ++k) {
      for (Eigen::Index l = 0; l <= k; ++l, ++i) {
        packed.re[i] = a(k, l).real();
        packed.im[i] = a(k, l).imag();
      }
    }
    return packed;
  }
  static Eigen::MatrixXcd unpack(const PackedHermitian& packed) {
    Eigen::MatrixXcd a(packed.channels, packed.channels);
    std::size_t i = 0;
    for (int k = 0; k < packed.channels; ++k) {
      for (int l = 0; l <= k; ++l, ++i) {
        a(k, l) = {packed.re[i], packed.im[i]};
        a(l, k) = std::conj(a(k, l));
      }
    }
    return a;
  }
  /// In single precision; Eigen's copy is rounded to the same numbers.
  static Field field(Eigen::MatrixXcd& a) {
    Field f;
    for (Eigen::Index k = 0; k < a.rows(); ++k) {
      for (Eigen::Index l = 0; l <= k; ++l) {
        f.emplace_back(a(k, l));
        a(k, l) = Complex(f.back());
        a(l, k) = std::conj(a(k, l));
      }
    }
    return f;
  }
  static double apart(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b) { return (a - b).norm() / b.norm(); }

  std::mt19937_64 random_{1};
  std::normal_distribution<double> normal_;
};
INSTANTIATE_TEST_SUITE_P(Channels, PackedHermitianTest, ::testing::Values(1, 3, 5, 8, 12, 16));

TEST_P(PackedHermitianTest, InverseAndDeterminantAgreeWithEigen) {
  const Eigen::MatrixXcd a = drawDefinite();
  InverseFactor factor;
  ASSERT_TRUE(factor.compute(pack(a)));
  EXPECT_EQ(factor.channels(), GetParam());
  EXPECT_LT(apart(unpack(factor.inverse()), a.inverse()), 1e-9);
  EXPECT_NEAR(factor.logDeterminant(), std::log(a.determinant().real()), 1e-9 * GetParam());
}

TEST_P(PackedHermitianTest, DeterminantNeitherOverflowsNorUnderflows) {
  for (double scale : {1e-60, 1e60}) {
    const Eigen::MatrixXcd a = drawDefinite();
    InverseFactor factor;
    ASSERT_TRUE(factor.compute(pack(scale * a)));
    EXPECT_NEAR(factor.logDeterminant(), std::log(a.determinant().real()) + GetParam() * std::log(scale), 1e-7);
  }
}

TEST_P(PackedHermitianTest, RefusesMatricesThatAreNotDefinite) {
  Eigen::MatrixXcd a = drawDefinite();
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd>(a).eigenvalues()[0];
  a -= (least + 0.05) * Eigen::MatrixXcd::Identity(a.rows(), a.rows());
  InverseFactor factor;
  EXPECT_FALSE(factor.compute(pack(a)));
  EXPECT_FALSE(factor.compute(PackedHermitian(GetParam()))) << "all zeros";
}

TEST_P(PackedHermitianTest, AppliesTheInverseFactor) {
  const Eigen::MatrixXcd a = drawDefinite();
  const Eigen::VectorXcd y = drawVector();
  InverseFactor factor;
  ASSERT_TRUE(factor.compute(pack(a)));
  Eigen::VectorXcd to(GetParam());
  factor.apply(y.data(), to.data());
  const Eigen::VectorXcd expected = a.llt().matrixL().solve(y);
  EXPECT_LT((to - expected).norm(), 1e-9 * expected.norm());
  Eigen::VectorXcd same = y;
  factor.apply(same.data(), same.data());
  EXPECT_EQ(same, to) << "in place";
}

TEST_P(PackedHermitianTest, WhitenedMatricesMultiplyAsDotProducts) {
  const Eigen::MatrixXcd s = drawDefinite(), d = drawHermitian(), e = drawHermitian(), inverse = s.inverse();
  InverseFactor factor;
  ASSERT_TRUE(factor.compute(pack(s)));
  const int numbers = GetParam() * GetParam();
  Eigen::VectorXd of_d(numbers), of_e(numbers);
  factor.whiten(pack(d), of_d.data());
  factor.whiten(pack(e), of_e.data());
  const double trace = (inverse * d * inverse * e).trace().real();
  EXPECT_NEAR(of_d.dot(of_e), trace, 1e-8 * of_d.norm() * of_e.norm());
  EXPECT_NEAR(traceOfWhitened(of_d.data(), GetParam()), (inverse * d).trace().real(), 1e-8 * of_d.norm());
}

TEST_P(PackedHermitianTest, SumsTracesAndQuadraticFormsAgreeWithEigen) {
  Eigen::MatrixXcd a = drawHermitian(), b = drawHermitian();
  const Eigen::MatrixXcd c = drawHermitian();
  const Field of_b = field(b);
  PackedHermitian sum = pack(a);
  sum.add(of_b.data(), 0.7);
  sum.add(pack(c), -1.3);
  const Eigen::MatrixXcd expected = a + 0.7 * b - 1.3 * c;
  EXPECT_LT(apart(unpack(sum), expected), 1e-12);
  EXPECT_NEAR(sum.trace(), expected.trace().real(), 1e-9);
  EXPECT_NEAR(sum.traceOfProduct(of_b.data()), (expected * b).trace().real(), 1e-9 * expected.norm() * b.norm());
  const Eigen::VectorXcd w = drawVector();
  EXPECT_NEAR(sum.quadratic(w.data()), w.dot(expected * w).real(), 1e-9 * expected.norm() * w.squaredNorm());
  sum.setZero();
  EXPECT_EQ(unpack(sum).norm(), 0);
}

TEST_P(PackedHermitianTest, TurnsAsADiagonalOfPhasesDoes) {
  std::vector<double> phase;
  for (int k = 0; k < GetParam(); ++k) phase.push_back(M_PI * k + 0.1 * normal_(random_));
  const PhasesApart apart_by(phase);
  // A small turn takes a series, a large one sines; none at all takes a short way.
  for (double turn : {0.0, 1e-3, 0.02, 0.6}) {
    Eigen::MatrixXcd a = drawHermitian(), b = drawHermitian();
    const Field of_a = field(a), of_b = field(b);
    Eigen::VectorXcd by(GetParam());
    for (int k = 0; k < GetParam(); ++k) by[k] = std::polar(1.0, phase[static_cast<std::size_t>(k)] * turn);
    PackedTurn packed_turn;
    packed_turn.set(apart_by, turn);
    const Eigen::MatrixXcd start = drawHermitian();
    PackedHermitian sum = pack(start);
    sum.addTurned({of_a.data(), nullptr, of_b.data()}, {0.5, 3.0, -2.0}, packed_turn);
    const Eigen::MatrixXcd turned = by.asDiagonal() * (0.5 * a - 2.0 * b) * by.conjugate().asDiagonal();
    EXPECT_LT(apart(unpack(sum), start + turned), 1e-8) << turn;
  }
}

TEST_P(PackedHermitianTest, TurnDerivativeIsASlope) {
  std::vector<double> phase;
  for (int k = 0; k < GetParam(); ++k) phase.push_back(2.5 * k);
  const Eigen::MatrixXcd a = drawHermitian();
  const auto turnedBy = [&](double turn) {
    Eigen::VectorXcd by(GetParam());
    for (int k = 0; k < GetParam(); ++k) by[k] = std::polar(1.0, phase[static_cast<std::size_t>(k)] * turn);
    return Eigen::MatrixXcd(by.asDiagonal() * a * by.conjugate().asDiagonal());
  };
  const double step = 1e-6, factor = 0.3;
  PackedHermitian sum(GetParam());
  sum.addTurnDerivative(pack(turnedBy(0.2)), factor, PhasesApart(phase));
  const Eigen::MatrixXcd slope = factor * (turnedBy(0.2 + step) - turnedBy(0.2 - step)) / (2 * step);
  EXPECT_LT((unpack(sum) - slope).norm(), 1e-6 * a.norm() * (1 + phase.back()));
}

TEST(PackedSums, ProductsOfAllPairsOfColumnsAgreeWithEigen) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  for (int rows : {1, 4, 7, 64}) {
    for (int columns : {1, 4, 6, 9}) {
      Eigen::MatrixXd v(rows, columns);
      for (double& x : v.reshaped()) x = normal(random);
      Eigen::MatrixXd products = Eigen::MatrixXd::Zero(columns, columns);
      pairProducts(v.data(), rows, columns, products.data());
      const Eigen::MatrixXd expected = v.transpose() * v;
      for (int a = 0; a < columns; ++a) {
        for (int b = 0; b <= a; ++b) EXPECT_NEAR(products(b, a), expected(a, b), 1e-10) << rows << " " << a << " " << b;
      }
    }
  }
}

TEST(PackedSums, MultiplesGoToFieldsOneBehindTheOther) {
  const Field from{{1, 2}, {3, -4}, {0, 5}};
  const float factors[] = {2, -1};
  Field to(6, {10, 20});
  addMultiples(from.data(), from.size(), factors, 2, to.data());
  EXPECT_EQ(to, (Field{{12, 24}, {16, 12}, {10, 30}, {9, 18}, {7, 24}, {10, 15}}));
}

TEST(BinCovariance, KnowsItsOwnBinsAlone) {
  BinCovariance field;
  field.first = 3;
  field.bins = 2;
  field.packed = {{1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}, {6, 0}};
  EXPECT_EQ(field.at(2, 3), nullptr);
  EXPECT_EQ(field.at(5, 3), nullptr);
  EXPECT_EQ(field.at(4, 3)[1], std::complex<float>(5, 0));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
