#include "packed_hermitian.h"

#include <algorithm>
#include <cmath>

// Twice as fast where the processor has AVX2; the same arithmetic otherwise.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define MMRADARTWIN_VECTORISED __attribute__((target_clones("arch=haswell", "default")))
#else
#define MMRADARTWIN_VECTORISED
#endif
#define MMRADARTWIN_INLINE inline __attribute__((always_inline))

namespace mmradartwin {
namespace {

/// The usual array's number of channels, known to the compiler; kAny stands for all others.
constexpr int kUsual = 8, kAny = 0;
constexpr double kSmallTurn_rad = 1.5;  // up to there a short series is right to 1e-9

template <int kChannels>
constexpr int packedSize(int channels) {
  const int n = kChannels == kAny ? channels : kChannels;
  return n * (n + 1) / 2;
}

template <int kChannels>
MMRADARTWIN_INLINE void addField(const float* from, double factor, int channels, double* re, double* im) {
  const int size = packedSize<kChannels>(channels);
  for (int i = 0; i < size; ++i) {
    re[i] += factor * static_cast<double>(from[2 * i]);
    im[i] += factor * static_cast<double>(from[2 * i + 1]);
  }
}

template <int kChannels>
MMRADARTWIN_INLINE void turnBy(const double* phase, double turn, int channels, double* re, double* im) {
  const int n = kChannels == kAny ? channels : kChannels;
  double sine[kMaxChannels], cosine[kMaxChannels];
  double most = 0;
  for (int k = 0; k < n; ++k) most = std::max(most, std::abs(phase[k] * turn));
  if (most < kSmallTurn_rad) {
    for (int k = 0; k < n; ++k) {
      const double x = phase[k] * turn, y = x * x;
      sine[k] = x * (1 - y / 6 * (1 - y / 20 * (1 - y / 42 * (1 - y / 72 * (1 - y / 110 * (1 - y / 156))))));
      cosine[k] = 1 - y / 2 * (1 - y / 12 * (1 - y / 30 * (1 - y / 56 * (1 - y / 90 * (1 - y / 132 * (1 - y / 182))))));
    }
  } else {
    for (int k = 0; k < n; ++k) {
      sine[k] = std::sin(phase[k] * turn);
      cosine[k] = std::cos(phase[k] * turn);
    }
  }
  for (int k = 1; k < n; ++k) {
    double *a = re + k * (k + 1) / 2, *b = im + k * (k + 1) / 2;
    for (int l = 0; l < k; ++l) {
      const double c = cosine[k] * cosine[l] + sine[k] * sine[l], s = sine[k] * cosine[l] - cosine[k] * sine[l];
      const double turned = a[l] * c - b[l] * s;
      b[l] = a[l] * s + b[l] * c;
      a[l] = turned;
    }
  }
}

/// Cholesky's factor column by column in place, then the inverse of it.
template <int kChannels>
MMRADARTWIN_INLINE bool invertFactor(const double* packed_re, const double* packed_im, int channels,
                                     double (*to_re)[kMaxChannels], double (*to_im)[kMaxChannels], double* log_det) {
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
      for (int k = 0; k < n; ++k) {  // rows above l are of no use
        re[l][k] -= re[j][k] * a + im[j][k] * b;
        im[l][k] -= im[j][k] * a - re[j][k] * b;
      }
    }
  }
  *log_det = sum + std::log(product);
  // L^-1, column by column: of each the rows below follow from those above.
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
MMRADARTWIN_INLINE void whitenBy(const double (*re)[kMaxChannels], const double (*im)[kMaxChannels],
                                 const double* packed_re, const double* packed_im, int channels, double* v) {
  const int n = kChannels == kAny ? channels : kChannels;
  double half_re[kMaxChannels][kMaxChannels], half_im[kMaxChannels][kMaxChannels];  // of L^-1 D, [column][row]
  for (int c = 0; c < n; ++c) {
    double *to_re = half_re[c], *to_im = half_im[c];
    for (int k = 0; k < n; ++k) to_re[k] = to_im[k] = 0;
    for (int i = 0; i < n; ++i) {
      const int at = i >= c ? i * (i + 1) / 2 + c : c * (c + 1) / 2 + i;
      const double a = packed_re[at], b = i > c ? packed_im[at] : i == c ? 0 : -packed_im[at];
      for (int k = 0; k < n; ++k) {
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
      for (int k = 0; k < n; ++k) {
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
  if (channels == kUsual) return addField<kUsual>(from, factor, channels, re, im);
  addField<kAny>(from, factor, channels, re, im);
}

MMRADARTWIN_VECTORISED void setTurnedTo(const float* const* fields, const double* factors, const double* phase,
                                        double turn, int channels, double* re, double* im) {
  const int size = channels * (channels + 1) / 2;
  for (int i = 0; i < size; ++i) re[i] = im[i] = 0;
  for (int f = 0; f < 3; ++f) {
    if (fields[f] == nullptr || factors[f] == 0) continue;
    if (channels == kUsual) {
      addField<kUsual>(fields[f], factors[f], channels, re, im);
    } else {
      addField<kAny>(fields[f], factors[f], channels, re, im);
    }
  }
  if (turn == 0) return;
  if (channels == kUsual) return turnBy<kUsual>(phase, turn, channels, re, im);
  turnBy<kAny>(phase, turn, channels, re, im);
}

MMRADARTWIN_VECTORISED bool invertFactorOf(const double* packed_re, const double* packed_im, int channels,
                                           double (*to_re)[kMaxChannels], double (*to_im)[kMaxChannels],
                                           double* log_det) {
  if (channels == kUsual) return invertFactor<kUsual>(packed_re, packed_im, channels, to_re, to_im, log_det);
  return invertFactor<kAny>(packed_re, packed_im, channels, to_re, to_im, log_det);
}

MMRADARTWIN_VECTORISED void whitenTo(const double (*re)[kMaxChannels], const double (*im)[kMaxChannels],
                                     const double* packed_re, const double* packed_im, int channels, double* v) {
  if (channels == kUsual) return whitenBy<kUsual>(re, im, packed_re, packed_im, channels, v);
  whitenBy<kAny>(re, im, packed_re, packed_im, channels, v);
}

const float* numbers(const std::complex<float>* field) { return reinterpret_cast<const float*>(field); }

}  // namespace

PackedHermitian::PackedHermitian(int count) : channels(count) { setZero(); }

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

void PackedHermitian::setTurned(const std::array<const std::complex<float>*, 3>& fields,
                                const std::array<double, 3>& factors, const double* phase, double turn) {
  const float* from[3] = {numbers(fields[0]), numbers(fields[1]), numbers(fields[2])};
  setTurnedTo(from, factors.data(), phase, turn, channels, re.data(), im.data());
}

void PackedHermitian::differentiateTurn(const double* phase) {
  std::size_t i = 0;
  for (int k = 0; k < channels; ++k) {
    for (int l = 0; l <= k; ++l, ++i) {
      const double by = phase[k] - phase[l], was = re[i];
      re[i] = -by * im[i];
      im[i] = by * was;
    }
  }
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

}  // namespace mmradartwin
