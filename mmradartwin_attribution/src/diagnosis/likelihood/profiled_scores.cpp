#include "diagnosis/likelihood/profiled_scores.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>

namespace mmradartwin::diagnosis::likelihood {

Eigen::MatrixXd regularised(Eigen::MatrixXd information) {
  information.diagonal().array() += 1e-9 * information.diagonal().array().abs() + 1e-12;
  return information;
}

ProfiledScores profiledScores(const Scores& scores, int globals) {
  ProfiledScores profiled;
  const Eigen::Index n = scores.information.rows() - globals;
  const Eigen::MatrixXd latent_information = scores.information.topLeftCorner(globals, globals);
  // [g][n].
  const Eigen::MatrixXd projection = latent_information.ldlt().solve(scores.information.topRightCorner(globals, n));
  profiled.by_location = scores.by_location.rightCols(n) - scores.by_location.leftCols(globals) * projection;
  profiled.information = regularised(scores.information.bottomRightCorner(n, n) -
                                     scores.information.topRightCorner(globals, n).transpose() * projection);
  profiled.total = scores.total.tail(n) - projection.transpose() * scores.total.head(globals);
  const double locations = static_cast<double>(profiled.by_location.rows());
  if (locations > 1 && n > 0) {
    const Eigen::MatrixXd centred = profiled.by_location.rowwise() - profiled.by_location.colwise().mean();
    profiled.scatter = centred.transpose() * centred * (locations / (locations - 1));
    // An actor's error is the same at all places: its prior shows it, the scatter over places does not.
    profiled.scatter += projection.transpose() * scores.prior.asDiagonal() * projection;
    const Eigen::MatrixXd ratio = profiled.information.ldlt().solve(profiled.scatter);
    profiled.overdispersion = std::min(ratio.trace() / static_cast<double>(n), kMostOverdispersion);
  }
  return profiled;
}

double overdispersionOf(double gain, const std::vector<double>& by_location) {
  const double locations = static_cast<double>(by_location.size());
  if (by_location.size() < 2 || !(gain > 0)) return 1;
  const double mean = std::accumulate(by_location.begin(), by_location.end(), 0.0) / locations;
  double squares = 0;
  for (double v : by_location) squares += (v - mean) * (v - mean);
  return std::clamp(squares * locations / (locations - 1) / (2 * gain), 1.0, kMostOverdispersion);
}

double overdispersionOfPresence(double gain, const std::vector<double>& by_location) {
  if (by_location.size() < 2 || !(gain > 0)) return 1;
  double squares = 0;
  for (double v : by_location) squares += std::min(v, 0.0) * std::min(v, 0.0);
  return std::clamp(squares / gain, 1.0, kMostOverdispersion);
}

SessionCovariance difference(SessionCovariance of, const SessionCovariance& from, const std::vector<int>& poses,
                             double per) {
  const float f = static_cast<float>(1 / per);
  for (std::size_t i = 0; i < of.size(); ++i) {
    const PoseCovariance& base = from[static_cast<std::size_t>(poses[i])];
    for (std::size_t j = 0; j < of[i].size(); ++j) of[i][j] = (of[i][j] - base[j]) * f;
  }
  return of;
}

SessionCovariance difference(SessionCovariance of, const SessionCovariance& from, double per) {
  const float f = static_cast<float>(1 / per);
  for (std::size_t i = 0; i < of.size(); ++i) {
    for (std::size_t j = 0; j < of[i].size(); ++j) of[i][j] = (of[i][j] - from[i][j]) * f;
  }
  return of;
}

SessionLatents withoutErrors(SessionLatents latents, int actor) {
  latents.actor_range_m[static_cast<std::size_t>(actor)] = 0;
  latents.actor_gain[static_cast<std::size_t>(actor)] = 0;
  return latents;
}

}  // namespace mmradartwin::diagnosis::likelihood
