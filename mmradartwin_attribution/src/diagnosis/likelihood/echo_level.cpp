#include "diagnosis/likelihood/echo_level.h"

#include <algorithm>
#include <cmath>

namespace mmradartwin::diagnosis::likelihood {
namespace {

constexpr double kUnknownShare = 0.05;                     ///< of the echoes: their level is not the twin's
constexpr double kLeftOfHidden[] = {0, 1e-4, 1e-3, 1e-2};  ///< power that edges and weaker ways leave of a hidden echo
constexpr double kLeastRest = 1e-9;
constexpr double kLeastSpread = 1e-5;  ///< a level known to 0.014 dB

/// Information that is left where it is not known which scale an echo has: 5/7 in Student's law (Lange, Little, Taylor
/// 1989).
constexpr double kShareOfInformation = 5.0 / 7;

/// Square of the echo's share of a cell from which on the level of a path is log-normal, and up to which it is that of
/// a sum of phasors; between them the law is a mixture.
constexpr double kPhasors = 0.6, kLogNormal = 0.9;

/// Law of x = |b|^2 / V: its log density, the slopes of that by the logarithms of V and of the spread, and the Fisher
/// information about both.
struct LevelLaw {
  double log_density, by_level, by_spread, level_information, spread_information;
};

/// Gamma law of mean 1. k log k - log Gamma(k) is Stirling's series, with an error below 1e-3 for k >= 1.
LevelLaw sumOfPhasors(double x, double squares, double spread) {
  const double k = std::max(1.0, 1 / (1 - (1 - spread) * squares)), log_x = std::log(x);
  const double factor = k + 0.5 * std::log(k / (2 * M_PI)) - 1 / (12 * k) + 1 / (360 * k * k * k);
  const double by_shape = 1 + 0.5 / k + 1 / (12 * k * k) + log_x - x;
  const double shape = spread < kMostSpread ? -k * k * squares * spread : 0;  // slope of k by the log spread
  return {factor + (k - 1) * log_x - k * x, k * (x - 1), by_shape * shape, k, 0.5 * shape * shape / (k * k)};
}

/// Log-normal law about the echo's share; the rest of the cell widens it as it widens the modulus of a long phasor.
LevelLaw logNormal(double x, double share, double spread) {
  const double variance = spread + 2 * (1 - share) / share, off = std::log(x / share);
  const double part = spread < kMostSpread ? spread / variance : 0;
  return {-std::log(x) - 0.5 * std::log(2 * M_PI * variance) - 0.5 * off * off / variance, off / variance,
          0.5 * part * (off * off / variance - 1), kShareOfInformation / variance,
          kShareOfInformation * 0.5 * part * part};
}

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
  determinant_ = factor.logDeterminant();
  squares_ = q;
  log_likelihood_ = -determinant_ - freedom * std::log1p(q / kTailFreedom);
  usual_ = known_ = by_level_ = level_information_ = echo_share_ = across_weight_ = 0;
  along_.fill(0);
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
  const double x = std::max(1e-30, std::norm(amplitude)), across = std::max(0.0, q - x);
  echo_share_ = std::min(1.0, echo.power * g);
  along_squares_ = x;
  across_weight_ = (freedom - 1) / (kTailFreedom + across);
  const double squares = echo_share_ * echo_share_;
  usual_ = (1 - kUnknownShare) * squares;
  const double faded =
      std::log((freedom - 1) / (kTailFreedom + across)) - freedom * std::log1p(x / (kTailFreedom + across));
  const double normal = std::clamp((squares - kPhasors) / (kLogNormal - kPhasors), 0.0, 1.0);
  const auto add = [&](double part, const LevelLaw& law) {
    const double ratio = usual_ * part * std::exp(law.log_density - faded);
    known_ += ratio;
    by_level_ += ratio * law.by_level;
    spread_score_ += ratio * law.by_spread;
    level_information_ += ratio * law.level_information;
    spread_information_ += ratio * law.spread_information;
  };
  for (const auto [factor, share] : kSpreadScales) {
    const double spread = std::clamp(factor * echo.spread, kLeastSpread, kMostSpread);
    if (normal < 1) add((1 - normal) * share, sumOfPhasors(x, squares, spread));
    if (normal > 0) add(normal * share, logNormal(x, echo_share_, spread));
  }
  const double both = 1 - usual_ + known_;
  log_likelihood_ += std::log(both);
  for (double* v : {&known_, &by_level_, &spread_score_, &level_information_, &spread_information_}) *v /= both;
}

double CellLikelihood::withoutEcho() const {
  // Sherman and Morrison: with the share f of its power left, the determinant changes by r = 1 - (1 - f) e, and what
  // lies along s weighs 1 / r as much.
  const double freedom = channels_ + kTailFreedom;
  double mean = 0;
  for (const double left : kLeftOfHidden) {
    const double rest = std::max(kLeastRest, 1 - (1 - left) * echo_share_);
    const double q = squares_ + along_squares_ * (1 - rest) / rest;
    mean += std::exp(-std::log(rest) - freedom * (std::log1p(q / kTailFreedom) - std::log1p(squares_ / kTailFreedom)));
  }
  return -determinant_ - freedom * std::log1p(squares_ / kTailFreedom) +
         std::log(std::max(1e-300, mean / std::size(kLeftOfHidden)));
}

void CellLikelihood::score(double* to) const {
  const int numbers = channels_ * channels_;
  std::fill(to, to + numbers, 0.0);
  const auto* across = across_.data();
  if (known_ > 0) {
    const auto* along = along_.data();
    addOuter(across, across, channels_, 0.5 * known_ * across_weight_, to);
    addOuter(across, along, channels_, known_ * across_weight_ * echo_share_, to);
    addOuter(unit_.data(), unit_.data(), channels_, 0.5 * (known_ + by_level_), to);
  }
  if (known_ < 1) {
    std::array<std::complex<double>, kMaxChannels> z = across_;
    for (int k = 0; k < channels_; ++k) z[k] += along_[k];
    addOuter(z.data(), z.data(), channels_, 0.5 * (1 - known_) * t_weight_, to);
  }
  int at = 0;
  for (int k = 0; k < channels_; at += 2 * k + 1, ++k) to[at] -= 1;
}

void CellLikelihood::level(double* to) const {
  std::fill(to, to + channels_ * channels_, 0.0);
  if (!(known_ > 0)) return;
  const double more = (level_information_ - known_) * (channels_ + kTailFreedom + 1) / (channels_ + kTailFreedom);
  addOuter(unit_.data(), unit_.data(), channels_, 0.5 * std::sqrt(std::max(0.0, more)), to);
}

}  // namespace mmradartwin::diagnosis::likelihood
