#include "diagnosis/likelihood/profiled_scores.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>

namespace mmradartwin::diagnosis::likelihood {

Eigen::MatrixXd regularised(Eigen::MatrixXd information) {
  information.diagonal().array() += 1e-9 * information.diagonal().array().abs() + 1e-12;
  return information;
}

ProfiledScores profiledScores(const Scores& s, int globals) {
  ProfiledScores e;
  const Eigen::Index n = s.information.rows() - globals;
  const Eigen::MatrixXd nuisance = s.information.topLeftCorner(globals, globals);
  const Eigen::MatrixXd projection = nuisance.ldlt().solve(s.information.topRightCorner(globals, n));  // [g][n]
  e.by_location = s.by_location.rightCols(n) - s.by_location.leftCols(globals) * projection;
  e.information = regularised(s.information.bottomRightCorner(n, n) -
                              s.information.topRightCorner(globals, n).transpose() * projection);
  e.total = s.total.tail(n) - projection.transpose() * s.total.head(globals);
  const double locations = static_cast<double>(e.by_location.rows());
  if (locations > 1 && n > 0) {
    const Eigen::MatrixXd centred = e.by_location.rowwise() - e.by_location.colwise().mean();
    e.scatter = centred.transpose() * centred * (locations / (locations - 1));
    // An actor's error is the same at all places: scatter over places does not show it, its prior does.
    e.scatter += projection.transpose() * s.prior.asDiagonal() * projection;
    const Eigen::MatrixXd ratio = e.information.ldlt().solve(e.scatter);
    e.overdispersion = std::min(ratio.trace() / static_cast<double>(n), kMostOverdispersion);
  }
  return e;
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

SessionLatents withoutErrors(SessionLatents nuisance, int actor) {
  nuisance.actor_range_m[static_cast<std::size_t>(actor)] = 0;
  nuisance.actor_gain[static_cast<std::size_t>(actor)] = 0;
  return nuisance;
}

}  // namespace mmradartwin::diagnosis::likelihood
