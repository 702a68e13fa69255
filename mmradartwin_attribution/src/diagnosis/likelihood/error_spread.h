#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::likelihood {

/// What the data say of errors of one kind, without the prior of these errors; everything else is refitted to first
/// order.
struct ErrorEvidence {
  Eigen::MatrixXd information;  ///< [errors][errors]
  Eigen::VectorXd weighted;     ///< [errors] information times the errors of greatest likelihood

  /// Replaces what the slopes at the fit say of one error, where the likelihood is higher by `nats` far away.
  void replace(int error, double value, double nats);
  /// Leaves out what all errors share, as if it were one more unknown: a common shift has a cause of its own.
  void leaveOutCommon();
};

/// Standard deviation of errors that are normally distributed about zero, by empirical Bayes: the likelihood of the
/// spread s with all errors integrated out (Laplace) is
///   log L(s) = sum_i 1/2 [ g_i^2 s^2 / (1 + s^2 l_i) - log(1 + s^2 l_i) ]
/// over the eigenvalues l_i of the information and the components g_i of `weighted` along its eigenvectors (restricted
/// maximum likelihood; Harville 1977, J. Am. Stat. Assoc. 72, 320). One error in twenty may be an outlier of five times
/// the spread, so that one actor that stands elsewhere does not stretch the spread of all. The stated spread is a
/// prior: log-normal, a factor of e wide. Nothing where the data say little.
std::optional<SpreadEstimate> estimatedSpread(const ErrorEvidence& evidence, double stated);

/// Standard deviation of an error over the spread of all, below which the session says something of it.
inline constexpr double kSaysSomething = 0.9;

/// Posterior mean and standard deviation of errors.
struct PosteriorErrors {
  std::vector<double> mean, standard_deviation;  ///< [errors]
};
/// Posterior of errors that are normal about zero with this spread.
PosteriorErrors posteriorErrors(const ErrorEvidence& evidence, double spread);
/// The same of the differences from what they share: from their mean, weighted by what the data say of each.
PosteriorErrors errorsBesideCommon(ErrorEvidence evidence, double spread);

/// Evidence of the actors' levels and of their ranges, and of the poses' headings, at fitted latents.
struct SessionEvidence {
  ErrorEvidence actor_gain, actor_range_m, yaw_rad;
};
SessionEvidence errorEvidence(const ChannelLikelihood& likelihood, const std::vector<PoseEchoes>& echoes,
                              const SessionLatents& latents);
/// Evidence of the actors' ranges that these poses alone have, about the latents of a basis.
ErrorEvidence rangeEvidence(const ChannelLikelihood& likelihood, const Basis& basis, const std::vector<int>& poses);

}  // namespace mmradartwin::diagnosis::likelihood
