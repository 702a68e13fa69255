#include "diagnosis/numbers/packed_hermitian.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

// Function clones for processors with AVX-512 or AVX2, where loops run up to three times as fast. The arithmetic is the
// same (-ffp-contract=off in CMakeLists.txt). A clone for one kind of processor, as "arch=haswell", is chosen on it
// alone.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define MMRADARTWIN_VECTORISED __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define MMRADARTWIN_VECTORISED
#endif
#define MMRADARTWIN_INLINE __attribute__((always_inline))

namespace mmradartwin::diagnosis::numbers {
namespace {

constexpr int kAny = 0;                 ///< stands for a number of channels that is known at run time only
constexpr int kWide = 4;                ///< numbers of a vector register
constexpr double kSmallTurn_rad = 0.7;  ///< up to which a short series is right to 1e-9

/// Calls the kernel with the number of channels as a constant, where four receivers and one to three transmitters give
/// it: loops of a known length run about twice as fast.
template <typename Kernel>
MMRADARTWIN_INLINE inline auto withConstant(int channels, Kernel kernel) {
  switch (channels) {
    case 4:
      return kernel(std::integral_constant<int, 4>());
    case 8:
      return kernel(std::integral_constant<int, 8>());
    case 12:
      return kernel(std::integral_constant<int, 12>());
    default:
      return kernel(std::integral_constant<int, kAny>());
  }
}

template <int kChannels>
constexpr int packedSize(int channels) {
  const int n = kChannels == kAny ? channels : kChannels;
  return n * (n + 1) / 2;
}

template <int kChannels>
MMRADARTWIN_INLINE inline void addField(const float* from, double factor, int channels, double* re, double* im) {
  const int size = packedSize<kChannels>(channels);
  for (int i = 0; i < size; ++i) {
    re[i] += factor * static_cast<double>(from[2 * i]);
    im[i] += factor * static_cast<double>(from[2 * i + 1]);
  }
}

template <int kChannels>
MMRADARTWIN_INLINE inline void phasors(const double* apart, double most, double turn, int channels, double* re,
                                       double* im) {
  const int size = packedSize<kChannels>(channels);
  if (most * std::abs(turn) < kSmallTurn_rad) {
    for (int i = 0; i < size; ++i) {
      const double x = apart[i] * turn, y = x * x;
      im[i] = x * (1 + y * (-1.0 / 6 + y * (1.0 / 120 + y * (-1.0 / 5040 + y * (1.0 / 362880)))));
      re[i] = 1 + y * (-0.5 + y * (1.0 / 24 + y * (-1.0 / 720 + y * (1.0 / 40320 + y * (-1.0 / 3628800)))));
    }
  } else {
    for (int i = 0; i < size; ++i) {
      im[i] = std::sin(apart[i] * turn);
      re[i] = std::cos(apart[i] * turn);
    }
  }
}

/// Computes the Cholesky factor column by column in place, then its inverse.
template <int kChannels>
MMRADARTWIN_INLINE inline bool invertFactor(const double* packed_re, const double* packed_im, int channels,
                                            double (*to_re)[kMaxChannels], double (*to_im)[kMaxChannels],
                                            double* log_det) {
  const int n = kChannels == kAny ? channels : kChannels;
  double re[kMaxChannels][kMaxChannels], im[kMaxChannels][kMaxChannels];  // [column][row]
  for (int l = 0; l < n; ++l) {
    for (int k = 0; k < n; ++k) {
      const int i = k * (k + 1) / 2 + l;
      re[l][k] = k >= l ? packed_re[i] : 0;
      im[l][k] = k > l ? packed_im[i] : 0;
    }
  }
  double product = 1, sum = 0, inverse_diagonal[kMaxChannels];
  for (int j = 0; j < n; ++j) {
    const double d = re[j][j];
    if (!(d > 0)) return false;
    product *= d;
    if (product < 1e-200 || product > 1e200) {
      sum += std::log(product);
      product = 1;
    }
    const double inverse = 1 / std::sqrt(d);
    inverse_diagonal[j] = inverse;
    for (int k = 0; k < n; ++k) {
      re[j][k] *= inverse;
      im[j][k] *= inverse;
    }
    for (int k = 0; k < j; ++k) re[j][k] = im[j][k] = 0;
    for (int l = j + 1; l < n; ++l) {
      const double a = re[j][l], b = im[j][l];
      for (int k = 0; k < n; ++k) {  // rows above l are not used
        re[l][k] -= re[j][k] * a + im[j][k] * b;
        im[l][k] -= im[j][k] * a - re[j][k] * b;
      }
    }
  }
  *log_det = sum + std::log(product);
  // L^-1 column by column: in each, the rows below follow from those above.
  for (int c = 0; c < n; ++c) {
    double x_re[kMaxChannels] = {}, x_im[kMaxChannels] = {};
    x_re[c] = 1;
    for (int j = c; j < n; ++j) {
      const double a = x_re[j] * inverse_diagonal[j], b = x_im[j] * inverse_diagonal[j];
      for (int k = 0; k < n; ++k) {
        x_re[k] -= re[j][k] * a - im[j][k] * b;
        x_im[k] -= re[j][k] * b + im[j][k] * a;
      }
      x_re[j] = a;
      x_im[j] = b;
    }
    for (int k = 0; k < n; ++k) {
      to_re[c][k] = k >= c ? x_re[k] : 0;
      to_im[c][k] = k >= c ? x_im[k] : 0;
    }
  }
  return true;
}

template <int kChannels>
MMRADARTWIN_INLINE inline void whitenBy(const double (*re)[kMaxChannels], const double (*im)[kMaxChannels],
                                        const double* packed_re, const double* packed_im, int channels, double* v) {
  const int n = kChannels == kAny ? channels : kChannels;
  double half_re[kMaxChannels][kMaxChannels], half_im[kMaxChannels][kMaxChannels];  // of L^-1 D, [column][row]
  for (int c = 0; c < n; ++c) {
    double *to_re = half_re[c], *to_im = half_im[c];
    for (int k = 0; k < n; ++k) to_re[k] = to_im[k] = 0;
    for (int i = 0; i < n; ++i) {
      const int place = i >= c ? i * (i + 1) / 2 + c : c * (c + 1) / 2 + i;
      const double a = packed_re[place], b = i > c ? packed_im[place] : i == c ? 0 : -packed_im[place];
      for (int k = i / kWide * kWide; k < n; ++k) {  // rows above are zero
        to_re[k] += re[i][k] * a - im[i][k] * b;
        to_im[k] += re[i][k] * b + im[i][k] * a;
      }
    }
  }
  for (int l = 0; l < n; ++l) {
    double sum_re[kMaxChannels], sum_im[kMaxChannels];
    for (int k = 0; k < n; ++k) sum_re[k] = sum_im[k] = 0;
    for (int j = 0; j <= l; ++j) {
      const double a = re[j][l], b = -im[j][l];
      for (int k = l / kWide * kWide; k < n; ++k) {
        sum_re[k] += half_re[j][k] * a - half_im[j][k] * b;
        sum_im[k] += half_re[j][k] * b + half_im[j][k] * a;
      }
    }
    v[l * l] = sum_re[l];
    for (int k = l + 1; k < n; ++k) {  // row k begins after 1 + 3 + ... = k^2 numbers
      v[k * k + 1 + 2 * l] = M_SQRT2 * sum_re[k];
      v[k * k + 2 + 2 * l] = M_SQRT2 * sum_im[k];
    }
  }
}

MMRADARTWIN_VECTORISED void addFieldTo(const float* from, double factor, int channels, double* re, double* im) {
  return withConstant(channels,
                      [&](auto n) MMRADARTWIN_INLINE { return addField<n()>(from, factor, channels, re, im); });
}

MMRADARTWIN_VECTORISED void phasorsTo(const double* apart, double most, double turn, int channels, double* re,
                                      double* im) {
  return withConstant(channels,
                      [&](auto n) MMRADARTWIN_INLINE { return phasors<n()>(apart, most, turn, channels, re, im); });
}

template <int kChannels>
MMRADARTWIN_INLINE inline void addTurned(const float* const* fields, const double* factors, const PackedTurn& turn,
                                         int channels, double* re, double* im) {
  const int size = packedSize<kChannels>(channels);
  const double *turn_re = turn.re.data(), *turn_im = turn.im.data();
  alignas(64) double own_re[kMaxPacked], own_im[kMaxPacked];
  for (int i = 0; i < size; ++i) own_re[i] = own_im[i] = 0;
  for (int f = 0; f < 3; ++f) {
    if (fields[f] != nullptr && factors[f] != 0) addField<kChannels>(fields[f], factors[f], channels, own_re, own_im);
  }
  for (int i = 0; i < size; ++i) {
    re[i] += own_re[i] * turn_re[i] - own_im[i] * turn_im[i];
    im[i] += own_re[i] * turn_im[i] + own_im[i] * turn_re[i];
  }
}

MMRADARTWIN_VECTORISED void addTurnedTo(const float* const* fields, const double* factors, const PackedTurn& turn,
                                        int channels, double* re, double* im) {
  return withConstant(
      channels, [&](auto n) MMRADARTWIN_INLINE { return addTurned<n()>(fields, factors, turn, channels, re, im); });
}

/// Takes four columns beside each other, so that each number is read once for four products. Clones of it are slower.
void pairProductsTo(const double* v, int rows, int columns, double* to) {
  for (int a = 0; a < columns; ++a) {
    const double* x = v + a * rows;
    int b = 0;
    for (; b + 3 <= a; b += 4) {
      const double *y0 = v + b * rows, *y1 = y0 + rows, *y2 = y1 + rows, *y3 = y2 + rows;
      double s0[kWide] = {}, s1[kWide] = {}, s2[kWide] = {}, s3[kWide] = {};
      int i = 0;
      for (; i + kWide <= rows; i += kWide) {
        for (int w = 0; w < kWide; ++w) {
          s0[w] += x[i + w] * y0[i + w];
          s1[w] += x[i + w] * y1[i + w];
          s2[w] += x[i + w] * y2[i + w];
          s3[w] += x[i + w] * y3[i + w];
        }
      }
      for (; i < rows; ++i) {
        s0[0] += x[i] * y0[i];
        s1[0] += x[i] * y1[i];
        s2[0] += x[i] * y2[i];
        s3[0] += x[i] * y3[i];
      }
      double* at = to + a * columns + b;
      at[0] = (s0[0] + s0[1]) + (s0[2] + s0[3]);
      at[1] = (s1[0] + s1[1]) + (s1[2] + s1[3]);
      at[2] = (s2[0] + s2[1]) + (s2[2] + s2[3]);
      at[3] = (s3[0] + s3[1]) + (s3[2] + s3[3]);
    }
    for (; b <= a; ++b) {
      double sum = 0;
      for (int i = 0; i < rows; ++i) sum += x[i] * v[b * rows + i];
      to[a * columns + b] = sum;
    }
  }
}

MMRADARTWIN_VECTORISED bool invertFactorOf(const double* packed_re, const double* packed_im, int channels,
                                           double (*to_re)[kMaxChannels], double (*to_im)[kMaxChannels],
                                           double* log_det) {
  return withConstant(channels, [&](auto n) MMRADARTWIN_INLINE {
    return invertFactor<n()>(packed_re, packed_im, channels, to_re, to_im, log_det);
  });
}

MMRADARTWIN_VECTORISED void whitenTo(const double (*re)[kMaxChannels], const double (*im)[kMaxChannels],
                                     const double* packed_re, const double* packed_im, int channels, double* v) {
  return withConstant(
      channels, [&](auto n) MMRADARTWIN_INLINE { return whitenBy<n()>(re, im, packed_re, packed_im, channels, v); });
}

MMRADARTWIN_VECTORISED void addMultiplesTo(const float* field, std::size_t numbers, const float* factors,
                                           std::size_t count, float* to) {
  for (std::size_t f = 0; f < count; ++f) {
    const float factor = factors[f];
    float* sum = to + f * numbers;
    for (std::size_t i = 0; i < numbers; ++i) sum[i] += factor * field[i];
  }
}

const float* numbers(const std::complex<float>* field) { return reinterpret_cast<const float*>(field); }

}  // namespace

PackedHermitian::PackedHermitian(int count) : channels(count) { setZero(); }

Eigen::MatrixXcd PackedHermitian::full() const {
  Eigen::MatrixXcd full(channels, channels);
  std::size_t i = 0;
  for (int k = 0; k < channels; ++k) {
    for (int l = 0; l <= k; ++l, ++i) {
      full(k, l) = {re[i], im[i]};
      full(l, k) = std::conj(full(k, l));
    }
  }
  return full;
}

void PackedHermitian::setZero() {
  std::fill_n(re.begin(), size(), 0.0);
  std::fill_n(im.begin(), size(), 0.0);
}

double PackedHermitian::trace() const {
  double sum = 0;
  for (int k = 0; k < channels; ++k) sum += re[static_cast<std::size_t>(diagonal(k))];
  return sum;
}

void PackedHermitian::add(const std::complex<float>* field, double factor) {
  addFieldTo(numbers(field), factor, channels, re.data(), im.data());
}

void PackedHermitian::add(const PackedHermitian& other, double factor) {
  const int count = size();
  for (int i = 0; i < count; ++i) {
    re[static_cast<std::size_t>(i)] += factor * other.re[static_cast<std::size_t>(i)];
    im[static_cast<std::size_t>(i)] += factor * other.im[static_cast<std::size_t>(i)];
  }
}

double PackedHermitian::traceOfProduct(const std::complex<float>* field) const {
  double all = 0, diagonals = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(size()); ++i) {
    all += re[i] * static_cast<double>(field[i].real()) + im[i] * static_cast<double>(field[i].imag());
  }
  for (int k = 0; k < channels; ++k) {
    const std::size_t i = static_cast<std::size_t>(diagonal(k));
    diagonals += re[i] * static_cast<double>(field[i].real());
  }
  return 2 * all - diagonals;
}

void PackedHermitian::addTurned(const std::array<const std::complex<float>*, 3>& fields,
                                const std::array<double, 3>& factors, const PackedTurn& turn) {
  if (turn.none) {
    for (std::size_t f = 0; f < fields.size(); ++f) {
      if (fields[f] != nullptr && factors[f] != 0) add(fields[f], factors[f]);
    }
    return;
  }
  const float* from[3] = {numbers(fields[0]), numbers(fields[1]), numbers(fields[2])};
  addTurnedTo(from, factors.data(), turn, channels, re.data(), im.data());
}

void PackedHermitian::addTurnDerivative(const PackedHermitian& turned, double by, const PhasesApart& apart) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(size()); ++i) {
    re[i] -= by * apart.packed[i] * turned.im[i];
    im[i] += by * apart.packed[i] * turned.re[i];
  }
}

PhasesApart::PhasesApart(const std::vector<double>& phase) : channels(static_cast<int>(phase.size())) {
  std::size_t i = 0;
  for (int k = 0; k < channels; ++k) {
    for (int l = 0; l <= k; ++l) {
      packed[i] = phase[static_cast<std::size_t>(k)] - phase[static_cast<std::size_t>(l)];
      most = std::max(most, std::abs(packed[i++]));
    }
  }
}

void PackedTurn::set(const PhasesApart& apart, double turn) {
  none = turn == 0;
  if (!none) phasorsTo(apart.packed.data(), apart.most, turn, apart.channels, re.data(), im.data());
}

double PackedHermitian::quadratic(const std::complex<double>* w) const {
  double sum = 0;
  std::size_t i = 0;
  for (int k = 0; k < channels; ++k) {
    for (int l = 0; l <= k; ++l, ++i) {
      const std::complex<double> product = std::conj(w[k]) * w[l];
      sum += (l < k ? 2 : 1) * (product.real() * re[i] - product.imag() * im[i]);
    }
  }
  return sum;
}

bool InverseFactor::compute(const PackedHermitian& matrix) {
  channels_ = matrix.channels;
  return invertFactorOf(matrix.re.data(), matrix.im.data(), channels_,
                        reinterpret_cast<double(*)[kMaxChannels]>(re_.data()),
                        reinterpret_cast<double(*)[kMaxChannels]>(im_.data()), &log_determinant_);
}

void InverseFactor::apply(const std::complex<double>* y, std::complex<double>* to) const {
  double sum_re[kMaxChannels] = {}, sum_im[kMaxChannels] = {};
  for (int j = 0; j < channels_; ++j) {
    const double a = y[j].real(), b = y[j].imag();
    const auto& column_re = re_[static_cast<std::size_t>(j)];
    const auto& column_im = im_[static_cast<std::size_t>(j)];
    for (std::size_t k = 0; k < static_cast<std::size_t>(channels_); ++k) {
      sum_re[k] += column_re[k] * a - column_im[k] * b;
      sum_im[k] += column_re[k] * b + column_im[k] * a;
    }
  }
  for (int k = 0; k < channels_; ++k) to[k] = {sum_re[k], sum_im[k]};
}

PackedHermitian InverseFactor::inverse() const {
  PackedHermitian s(channels_);
  std::size_t i = 0;
  const std::size_t n = static_cast<std::size_t>(channels_);
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t l = 0; l <= k; ++l, ++i) {
      for (std::size_t j = k; j < n; ++j) {
        s.re[i] += re_[k][j] * re_[l][j] + im_[k][j] * im_[l][j];
        s.im[i] += re_[k][j] * im_[l][j] - im_[k][j] * re_[l][j];
      }
    }
  }
  return s;
}

void InverseFactor::whiten(const PackedHermitian& matrix, double* to) const {
  whitenTo(reinterpret_cast<const double(*)[kMaxChannels]>(re_.data()),
           reinterpret_cast<const double(*)[kMaxChannels]>(im_.data()), matrix.re.data(), matrix.im.data(), channels_,
           to);
}

double traceOfWhitened(const double* v, int channels) {
  double sum = 0;
  for (int k = 0; k < channels; ++k) sum += v[k * k];
  return sum;
}

void addMultiples(const std::complex<float>* field, std::size_t size, const float* factors, std::size_t count,
                  std::complex<float>* to) {
  addMultiplesTo(numbers(field), 2 * size, factors, count, reinterpret_cast<float*>(to));
}

void pairProducts(const double* v, int rows, int columns, double* to) { pairProductsTo(v, rows, columns, to); }

}  // namespace mmradartwin::diagnosis::numbers
