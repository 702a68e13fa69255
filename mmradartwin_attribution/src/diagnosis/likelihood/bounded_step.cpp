#include "diagnosis/likelihood/bounded_step.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

namespace mmradartwin::diagnosis::likelihood {
namespace {

constexpr int kMostChanges = 4;  ///< of the set of held numbers, for each number: the set seldom changes twice

/// Maximum over the numbers that are not held.
Eigen::VectorXd maximumOf(const Eigen::MatrixXd& information, const Eigen::VectorXd& score, Eigen::VectorXd step,
                          const std::vector<char>& held) {
  std::vector<Eigen::Index> free, fixed;
  for (Eigen::Index j = 0; j < score.size(); ++j) (held[static_cast<std::size_t>(j)] ? fixed : free).push_back(j);
  const Eigen::MatrixXd own = information(free, free);
  const Eigen::VectorXd rest = score(free) - information(free, fixed) * step(fixed);
  const Eigen::VectorXd solved = own.ldlt().solve(rest);
  step(free) = solved;
  return step;
}

}  // namespace

BoundedStep boundedStep(const Eigen::MatrixXd& information, const Eigen::VectorXd& score, const Eigen::VectorXd& low,
                        const Eigen::VectorXd& high) {
  const Eigen::Index n = score.size();
  BoundedStep result{Eigen::VectorXd::Zero(n), 0};
  Eigen::VectorXd& step = result.step;
  std::vector<char> held(static_cast<std::size_t>(n), 0);
  for (Eigen::Index change = 0; change < kMostChanges * n; ++change) {
    // As far towards the maximum of the free numbers as the bounds allow.
    const Eigen::VectorXd along = maximumOf(information, score, step, held) - step;
    double share = 1;
    Eigen::Index blocking = -1;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (held[static_cast<std::size_t>(j)] || along[j] == 0) continue;
      const double most = std::max(0.0, ((along[j] > 0 ? high[j] : low[j]) - step[j]) / along[j]);
      if (most >= share) continue;
      share = most;
      blocking = j;
    }
    step += share * along;
    if (blocking >= 0) {
      step[blocking] = along[blocking] > 0 ? high[blocking] : low[blocking];
      held[static_cast<std::size_t>(blocking)] = 1;
      continue;
    }
    // A held number that the quadratic draws back from its bound is free again.
    const Eigen::VectorXd slope = score - information * step;
    double strongest = 0;
    Eigen::Index freed = -1;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (!held[static_cast<std::size_t>(j)] || low[j] == high[j]) continue;
      const double inward = step[j] == high[j] ? -slope[j] : slope[j];
      const double nats = inward > 0 ? inward * inward / information(j, j) : 0;
      if (nats <= strongest) continue;
      strongest = nats;
      freed = j;
    }
    constexpr double kNothing_nats = 1e-9;
    if (strongest < kNothing_nats) break;
    held[static_cast<std::size_t>(freed)] = 0;
  }
  result.promised_nats = score.dot(step) - 0.5 * step.dot(information * step);
  return result;
}

}  // namespace mmradartwin::diagnosis::likelihood
