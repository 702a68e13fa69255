#include "diagnosis/likelihood/echo_level.h"

#include <algorithm>
#include <cmath>

namespace mmradartwin::diagnosis::likelihood {
namespace {

constexpr double kUnknownShare = 0.05;  ///< of the echoes: their level is not the twin's
constexpr double kMostShape = 1e5;      ///< a level known to 0.014 dB

/// k log k - log Gamma(k), by Stirling's series; error below 1e-3 for k >= 1.
double logShapeFactor(double k) { return k + 0.5 * std::log(k / (2 * M_PI)) - 1 / (12 * k) + 1 / (360 * k * k * k); }

/// Writes the Hermitian a b^H + b a^H (or a a^H where both are the same) times f, added to `to`.
void addOuter(const std::complex<double>* a, const std::complex<double>* b, int channels, double f, double* to) {
  for (int k = 0; k < channels; ++k) {
    *to++ += f * 2 * (a[k] * std::conj(b[k])).real();
    for (int l = 0; l < k; ++l) {
      const std::complex<double> v = a[k] * std::conj(b[l]) + b[k] * std::conj(a[l]);
      *to++ += f * M_SQRT2 * v.real();
      *to++ += f * M_SQRT2 * v.imag();
    }
  }
}

}  // namespace

CellLikelihood::CellLikelihood(const InverseFactor& factor, const std::complex<double>* z, const CellEcho& echo)
    : channels_(factor.channels()) {
  double q = 0;
  for (int k = 0; k < channels_; ++k) q += std::norm(z[k]);
  const double freedom = channels_ + kTailFreedom;
  t_weight_ = freedom / (kTailFreedom + q);
  log_likelihood_ = -factor.logDeterminant() - freedom * std::log1p(q / kTailFreedom);
  known_ = shape_ = x_ = echo_share_ = across_weight_ = 0;
  std::copy(z, z + channels_, across_.begin());
  if (!(echo.power > 0)) return;
  factor.apply(echo.direction.data(), unit_.data());
  double g = 0;
  for (int k = 0; k < channels_; ++k) g += std::norm(unit_[k]);
  std::complex<double> amplitude = 0;
  for (int k = 0; k < channels_; ++k) {
    unit_[k] /= std::sqrt(g);
    amplitude += std::conj(unit_[k]) * z[k];
  }
  for (int k = 0; k < channels_; ++k) {
    along_[k] = unit_[k] * amplitude;
    across_[k] -= along_[k];
  }
  x_ = std::norm(amplitude);
  const double across = std::max(0.0, q - x_);
  echo_share_ = std::min(1.0, echo.power * g);
  across_weight_ = (freedom - 1) / (kTailFreedom + across);
  const double squares = echo_share_ * echo_share_, spread = std::min(1.0, echo.spread);
  shape_ = std::clamp(1 / (1 - (1 - spread) * squares), 1.0, kMostShape);
  const double usual = (1 - kUnknownShare) * squares;  // share of the known level
  const double faded = std::log((freedom - 1) / (kTailFreedom + across)) -
                       freedom * std::log1p(x_ / (kTailFreedom + across));
  const double log_x = std::log(std::max(1e-300, x_));
  const double ratio = usual * std::exp(logShapeFactor(shape_) + (shape_ - 1) * log_x - shape_ * x_ - faded);
  const double both = 1 - usual + ratio;
  log_likelihood_ += std::log(both);
  known_ = ratio / both;
  const double by_shape = 1 + 0.5 / shape_ + 1 / (12 * shape_ * shape_) + log_x - x_;
  const double shape_by_spread = spread < 1 ? -shape_ * shape_ * squares * spread : 0;
  spread_score_ = known_ * by_shape * shape_by_spread;
  spread_information_ = known_ * 0.5 / (shape_ * shape_) * shape_by_spread * shape_by_spread;
}

void CellLikelihood::score(double* to) const {
  const int numbers = channels_ * channels_;
  std::fill(to, to + numbers, 0.0);
  const auto* across = across_.data();
  if (known_ > 0) {
    const auto* along = along_.data();
    addOuter(across, across, channels_, 0.5 * known_ * across_weight_, to);
    addOuter(across, along, channels_, known_ * across_weight_ * echo_share_, to);
    addOuter(unit_.data(), unit_.data(), channels_, 0.5 * known_ * (1 + shape_ * (x_ - 1)), to);
  }
  if (known_ < 1) {
    std::array<std::complex<double>, kMaxChannels> z = across_;
    if (shape_ > 0) {
      for (int k = 0; k < channels_; ++k) z[k] += along_[k];
    }
    addOuter(z.data(), z.data(), channels_, 0.5 * (1 - known_) * t_weight_, to);
  }
  int at = 0;
  for (int k = 0; k < channels_; at += 2 * k + 1, ++k) to[at] -= 1;
}

void CellLikelihood::level(double* to) const {
  std::fill(to, to + channels_ * channels_, 0.0);
  if (!(known_ > 0)) return;
  const double more = known_ * (shape_ - 1) * (channels_ + kTailFreedom + 1) / (channels_ + kTailFreedom);
  addOuter(unit_.data(), unit_.data(), channels_, 0.5 * std::sqrt(std::max(0.0, more)), to);
}

}  // namespace mmradartwin::diagnosis::likelihood
