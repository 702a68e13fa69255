#pragma once

#include <array>
#include <complex>
#include <vector>

#include "diagnosis/numbers/bin_covariance.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::numbers {

constexpr int kMaxChannels = 16;
constexpr int kMaxPacked = kMaxChannels * (kMaxChannels + 1) / 2;

/// phase[k] - phase[l] of the channels' phases by the sine of a direction, in the same order as the matrices below.
struct PhasesApart {
  alignas(64) std::array<double, kMaxPacked> packed;
  double most = 0;
  int channels = 0;
  explicit PhasesApart(const std::vector<double>& phase);
};

/// Turns such matrices: element (k, l) times exp(j (phase[k] - phase[l]) turn). Phases alone keep a matrix definite.
struct PackedTurn {
  alignas(64) std::array<double, kMaxPacked> re, im;
  bool none = true;
  void set(const PhasesApart& apart, double turn);
};

/// A Hermitian matrix of up to kMaxChannels rows: its lower triangle row by row as BinCovariance has it, in double
/// precision, real and imaginary parts apart, so that sums of such matrices are loops over plain numbers. The
/// likelihood's time is spent here.
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
  /// The same of up to three fields (null: nothing), turned.
  void addTurned(const std::array<const std::complex<float>*, 3>& fields, const std::array<double, 3>& factors,
                 const PackedTurn& turn);
  /// Adds the derivative of a turned matrix by its turn, times `by`: element (k, l) times j (phase[k] - phase[l]).
  void addTurnDerivative(const PackedHermitian& turned, double by, const PhasesApart& apart);
  /// Trace of this times a field.
  double traceOfProduct(const std::complex<float>* field) const;
  /// w^H this w.
  double quadratic(const std::complex<double>* w) const;
};

/// The inverse of the Cholesky factor of such a matrix: L^-1.
class InverseFactor {
 public:
  /// False where the matrix is not definite.
  bool compute(const PackedHermitian& matrix);
  double logDeterminant() const { return log_determinant_; }
  /// The matrix' inverse.
  PackedHermitian inverse() const;
  /// L^-1 y; its squared norm is y^H matrix^-1 y. y and to: [channels], may be the same.
  void apply(const std::complex<double>* y, std::complex<double>* to) const;
  /// L^-1 D L^-H as M^2 real numbers, so that tr(D~ E~) is a dot product: of row k its diagonal, then real and
  /// imaginary parts of the elements before it, times sqrt 2.
  void whiten(const PackedHermitian& matrix, double* to) const;
  int channels() const { return channels_; }

 private:
  using Columns = std::array<std::array<double, kMaxChannels>, kMaxChannels>;
  int channels_ = 0;
  double log_determinant_ = 0;
  alignas(64) Columns re_, im_;  ///< [column][row], the lower triangle, zero above it
};

/// Adds a field of `size` numbers times each of `count` factors to as many fields that stand one behind the other.
void addMultiples(const std::complex<float>* field, std::size_t size, const float* factors, std::size_t count,
                  std::complex<float>* to);

/// Sum of the diagonal of what whiten() gives.
double traceOfWhitened(const double* v, int channels);

/// Products of all pairs of columns of v [rows][columns], column by column: to[a * columns + b] for b <= a.
void pairProducts(const double* v, int rows, int columns, double* to);

}  // namespace mmradartwin::diagnosis::numbers
