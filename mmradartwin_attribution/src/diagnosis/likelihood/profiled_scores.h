#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::likelihood {

/// Step of numerical derivatives, scaled. An echo 35 to 60 dB above its floor turns away from its covariance within
/// some millimetres: at six times this step a score was three times the slope of the likelihood. Ten times less would
/// show the rounding of single precision.
constexpr double kSmallStep = 0.02;
constexpr double kMostOverdispersion = 50;  ///< limit of every overdispersion over places

/// Scores of a hypothesis' coordinates with everything else of the model refitted to first order (Schur complement).
struct ProfiledScores {
  Eigen::MatrixXd by_location;  ///< [locations][n]
  Eigen::MatrixXd information;  ///< [n][n]
  Eigen::MatrixXd scatter;  ///< [n][n] covariance of the total score, from its scatter over places and from the priors
  Eigen::VectorXd total;    ///< [n]
  double overdispersion = 1;  ///< scatter over places, divided by what the likelihood expects
};

/// Information with a tiny diagonal added, so that it can be inverted where a direction does nothing.
Eigen::MatrixXd regularised(Eigen::MatrixXd information);
ProfiledScores profiledScores(const Scores& scores, int globals);
/// Variance of a gain of G nats over places, divided by that of a gain by chance (2 G); limited to 1 to
/// kMostOverdispersion.
double overdispersionOf(double gain, const std::vector<double>& by_location);
/// Overdispersion of the gain of something that is present or absent. Few places may see it, so that its gain is uneven
/// by nature: only places that lose are counted.
double overdispersionOfPresence(double gain, const std::vector<double>& by_location);
/// Change of covariances from `from` to `of`, divided by `per`. of[i] belongs to poses[i], from to all poses.
SessionCovariance difference(SessionCovariance of, const SessionCovariance& from, const std::vector<int>& poses,
                             double per);
/// Change of covariances from `from` to `of`, divided by `per`; both belong to the same poses.
SessionCovariance difference(SessionCovariance of, const SessionCovariance& from, double per);
/// Latents with the errors of one actor set to zero.
SessionLatents withoutErrors(SessionLatents latents, int actor);

}  // namespace mmradartwin::diagnosis::likelihood
