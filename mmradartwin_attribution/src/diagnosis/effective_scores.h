#pragma once

#include <Eigen/Core>
#include <vector>

#include "hypothesis.h"
#include "session_model.h"

namespace mmradartwin {

constexpr double kSmallStep = 0.125;   ///< of a coordinate's scale, for derivatives
constexpr double kMostInflation = 50;  ///< of a gain's or a score's scatter over places

/// Scores of a hypothesis' coordinates with everything else of the model refitted to first order.
struct EffectiveScores {
  Eigen::MatrixXd by_location;  // [L][n]
  Eigen::MatrixXd information;  // [n][n]
  Eigen::MatrixXd scatter;      // [n][n] of the scores' sums, over places and the latents' priors
  Eigen::VectorXd total;
  double inflation = 1;  ///< of their scatter over places against what the likelihood expects
};

/// An information that can be solved with, also where a direction does nothing.
Eigen::MatrixXd regularised(Eigen::MatrixXd information);
EffectiveScores effectiveScores(const Scores& scores, int globals);
/// Of a gain that scatters over places more than one by chance would: of G nats, sqrt(2 G).
double inflationOf(double gain, const std::vector<double>& by_location);
/// The same for what is there or not, whose paths may be seen from few places: those that see none do not gain, and it
/// is those that lose that tell of chance.
double inflationOfPresence(double gain, const std::vector<double>& by_location);
/// Of scatter over so many places and the usual one (usualScatter()), weighed by what each is known by; at least 1.
double moderated(double inflation, const Hypothesis& hypothesis, std::size_t locations);

/// A change of covariances by `per`. of[i] is of poses[i], from is of all poses.
SessionCovariance difference(SessionCovariance of, const SessionCovariance& from, const std::vector<int>& poses,
                             double per);
/// The same between two sides; both are of the same poses.
SessionCovariance difference(SessionCovariance of, const SessionCovariance& from, double per);
/// With no error of this actor's own.
Nuisance withoutErrors(Nuisance nuisance, int actor);

}  // namespace mmradartwin
