#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <vector>

#include "diagnosis/numbers/bin_covariance.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::numbers {

constexpr int kMaxChannels = 16;  ///< of a radar's virtual array
constexpr int kMaxPacked = kMaxChannels * (kMaxChannels + 1) / 2;

/// Differences phase[k] - phase[l] of the channels' phases per unit sine of a direction, in the order of
/// PackedHermitian.
struct PhasesApart {
  alignas(64) std::array<double, kMaxPacked> packed;
  double most = 0;  ///< largest size
  int channels = 0;
  explicit PhasesApart(const std::vector<double>& phase);
};

/// Phase factors exp(j (phase[k] - phase[l]) turn) that turn a PackedHermitian element by element. A definite matrix
/// stays definite.
struct PackedTurn {
  alignas(64) std::array<double, kMaxPacked> re, im;
  bool none = true;  ///< turn is 0
  void set(const PhasesApart& apart, double turn);
};

/// Hermitian matrix of up to kMaxChannels rows: its lower triangle row by row as in BinCovariance, in double precision.
/// Real and imaginary parts stand apart, so that sums of matrices are loops over plain numbers. The likelihood spends
/// its time here.
struct PackedHermitian {
  alignas(64) std::array<double, kMaxPacked> re, im;
  int channels = 0;

  explicit PackedHermitian(int channels);
  int size() const { return channels * (channels + 1) / 2; }
  static int diagonal(int row) { return row * (row + 3) / 2; }
  void setZero();
  double trace() const;
  /// Adds a field of single precision times a factor.
  void add(const std::complex<float>* field, double factor);
  void add(const PackedHermitian& other, double factor);
  /// Adds up to three fields times their factors, turned; a null field adds nothing.
  void addTurned(const std::array<const std::complex<float>*, 3>& fields, const std::array<double, 3>& factors,
                 const PackedTurn& turn);
  /// Adds `by` times the derivative of a turned matrix with respect to the turn: element (k, l) times
  /// j (phase[k] - phase[l]).
  void addTurnDerivative(const PackedHermitian& turned, double by, const PhasesApart& apart);
  /// Trace of the product of this matrix and a field.
  double traceOfProduct(const std::complex<float>* field) const;
  /// Quadratic form w^H S w of this matrix S.
  double quadratic(const std::complex<double>* w) const;
  Eigen::MatrixXcd full() const;
};

/// Inverse L^-1 of the Cholesky factor of a PackedHermitian S = L L^H.
class InverseFactor {
 public:
  /// Factors the matrix; false where it is not positive definite.
  bool compute(const PackedHermitian& matrix);
  double logDeterminant() const { return log_determinant_; }
  /// Inverse S^-1.
  PackedHermitian inverse() const;
  /// Computes L^-1 y, whose squared norm is y^H S^-1 y. y and to hold [channels] and may be the same.
  void apply(const std::complex<double>* y, std::complex<double>* to) const;
  /// Writes L^-1 D L^-H as M^2 real numbers, so that tr(S^-1 D S^-1 E) is the dot product of two of them. Row k holds
  /// its diagonal, then real and imaginary parts of the elements before it, times sqrt 2.
  void whiten(const PackedHermitian& matrix, double* to) const;
  int channels() const { return channels_; }

 private:
  using Columns = std::array<std::array<double, kMaxChannels>, kMaxChannels>;
  int channels_ = 0;
  double log_determinant_ = 0;
  alignas(64) Columns re_, im_;  ///< [column][row], the lower triangle, zero above it
};

/// Adds a field of `size` numbers, times each of `count` factors, to `count` fields that stand one behind the other.
void addMultiples(const std::complex<float>* field, std::size_t size, const float* factors, std::size_t count,
                  std::complex<float>* to);

/// Trace of a matrix as InverseFactor::whiten() writes it.
double traceOfWhitened(const double* v, int channels);

/// Dot products of all pairs of columns of v, which stands column by column: to[a * columns + b] for b <= a.
void pairProducts(const double* v, int rows, int columns, double* to);

}  // namespace mmradartwin::diagnosis::numbers
