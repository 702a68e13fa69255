#pragma once

#include <array>
#include <complex>

#include "diagnosis/numbers/packed_hermitian.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::likelihood {

constexpr double kTailFreedom = 4;  ///< degrees of freedom of a cell's complex t distribution

/// Spreads differ from echo to echo: some levels are known better than the session's spread says, a few much worse. The
/// shares are those that an inverse gamma law of 4 degrees of freedom has up to 1, 4 and beyond, so that the level's
/// logarithm follows nearly Student's law. Levels that scatter normally are likeliest with their own variance as the
/// spread: the factors are 1/2, 2 and 8 of 0.669, which is the maximum of the likelihood on a normal law.
struct SpreadScale {
  double factor, share;  ///< on the variance of the level; of the echoes
};
constexpr SpreadScale kSpreadScales[] = {{0.334, 0.406}, {1.338, 0.504}, {5.352, 0.090}};

/// Beyond it an echo fades as a sum of phasors does. A log-normal law of a larger variance v has its mode at exp(-v),
/// where its density is exp(v / 2): it would reward parameters that let the measured echo vanish.
constexpr double kMostSpread = 1;

/// The strongest echo of a cell.
struct CellEcho {
  double power = 0;                                          ///< root of the sum of its paths' squared powers
  double spread = 0;                                         ///< variance of its power over the square of its mean
  std::array<std::complex<double>, kMaxChannels> direction;  ///< response of the channels, squared norm [channels]
};

/// Log-likelihood of one cell's channels y under the covariance Sigma = P s s^H + S, where the level of the echo P s
/// s^H is known and its phase is not.
///
/// Under the complex t distribution alone an echo fades: |b|^2, with b = s^H Sigma^-1 y / s^H Sigma^-1 s, is
/// distributed about its mean V = 1 / s^H Sigma^-1 s as an exponential is, however well P is known. Here b has the
/// distribution of a sum of phasors of known lengths, matched by two moments: |b|^2 is Gamma-distributed with shape
/// k = V^2 / variance, where the variance is V^2 less the squares of the paths' powers, plus the spread of the level.
/// Where one path stands alone, its level is nearly Student-distributed in dB (kSpreadScales). Then it gives about the
/// information 1 / spread about the logarithm of its power; many paths give 1, as fading does. What of y is
/// uncorrelated with b keeps the t distribution, of one dimension less, so that clutter of another level than expected
/// does not move the level of an echo. A share of echoes follows no known level and fades. See
/// docs/reference/diagnosis.md.
class CellLikelihood {
 public:
  /// z: [channels] L^-1 y, with Sigma = L L^H as factor has it.
  CellLikelihood(const InverseFactor& factor, const std::complex<double>* z, const CellEcho& echo);

  double logLikelihood() const { return log_likelihood_; }
  /// Probability that the level is expected to be known by, less that with which the measured level is it.
  double astray() const { return usual_ - known_; }
  /// Log-likelihood of the same channels where the echo is hidden: of its power nothing is left, or 20 to 40 dB less.
  double withoutEcho() const;
  /// Score by the echo's log spread, and its information.
  double spreadScore() const { return spread_score_; }
  double spreadInformation() const { return spread_information_; }
  /// Hermitian matrix H as InverseFactor::whiten() writes one: tr(H L^-1 D L^-H) is the score by a change D of Sigma.
  /// Writes [channels^2] numbers.
  void score(double* to) const;
  /// Unit vector u = L^-1 s / |L^-1 s| as the matrix f u u^H, written in the same way. The square of its product with
  /// a whitened change of Sigma is what the known level adds to the product of a change with itself in
  /// tInformation().
  void level(double* to) const;

 private:
  int channels_;
  std::array<std::complex<double>, kMaxChannels> along_, across_, unit_;  ///< parts of z along u and across; u
  double determinant_, squares_;                                          ///< log |Sigma|, and |z|^2
  double along_squares_ = 0;                                              ///< of z along u
  double log_likelihood_, t_weight_, across_weight_, echo_share_;
  double usual_, known_;                 ///< probability that the level is known, before and after it is measured
  double by_level_, level_information_;  ///< slope and information of the known level
  double spread_score_ = 0, spread_information_ = 0;
};

/// Fisher information of the complex t distribution about its covariance (Lange, Little and Taylor 1989, in complex
/// form).
inline double tInformation(int channels, double product, double trace_a, double trace_b) {
  return ((channels + kTailFreedom) * product - trace_a * trace_b) / (channels + kTailFreedom + 1);
}

}  // namespace mmradartwin::diagnosis::likelihood
