#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::likelihood {

constexpr double kSmallStep = 0.125;        ///< of a coordinate's scale, for derivatives
constexpr double kMostOverdispersion = 50;  ///< of a gain's or a score's scatter over places

/// Scores of a hypothesis' coordinates with everything else of the model refitted to first order.
struct ProfiledScores {
  Eigen::MatrixXd by_location;  // [L][n]
  Eigen::MatrixXd information;  // [n][n]
  Eigen::MatrixXd scatter;      // [n][n] of the scores' sums, over places and the latents' priors
  Eigen::VectorXd total;
  double overdispersion = 1;  ///< of their scatter over places against what the likelihood expects
};

/// An information that can be solved with, also where a direction does nothing.
Eigen::MatrixXd regularised(Eigen::MatrixXd information);
ProfiledScores profiledScores(const Scores& scores, int globals);
/// Of a gain that scatters over places more than one by chance would: of G nats, sqrt(2 G).
double overdispersionOf(double gain, const std::vector<double>& by_location);
/// The same for what is there or not, whose paths may be seen from few places: those that see none do not gain, and it
/// is those that lose that tell of chance.
double overdispersionOfPresence(double gain, const std::vector<double>& by_location);
/// A change of covariances by `per`. of[i] is of poses[i], from is of all poses.
SessionCovariance difference(SessionCovariance of, const SessionCovariance& from, const std::vector<int>& poses,
                             double per);
/// The same between two sides; both are of the same poses.
SessionCovariance difference(SessionCovariance of, const SessionCovariance& from, double per);
/// With no error of this actor's own.
SessionLatents withoutErrors(SessionLatents nuisance, int actor);

}  // namespace mmradartwin::diagnosis::likelihood
