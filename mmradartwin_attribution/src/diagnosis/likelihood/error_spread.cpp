#include "diagnosis/likelihood/error_spread.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/likelihood/profiled_scores.h"

namespace mmradartwin::diagnosis::likelihood {
namespace {

constexpr double kOutlierShare = 0.05, kOutlierWidth = 5;  ///< share of outliers and their spread over that of the rest
constexpr double kPriorWidth = 1;                          ///< of the logarithm of the spread about the stated one
constexpr double kWidestPosterior = 0.6;                   ///< of the logarithm; beyond it the prior has said it all
constexpr double kGridSpan = 4, kGridStep = 0.02;          ///< logarithms of the spread over the stated one
constexpr int kReweightings = 15;

/// Logarithms of the posterior of the spread on the grid. precision: [errors] weight of each error, 1 of one that is no
/// outlier.
Eigen::VectorXd logPosterior(const ErrorEvidence& evidence, const Eigen::VectorXd& precision,
                             const Eigen::VectorXd& log_ratio, double stated) {
  const Eigen::VectorXd root = precision.cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(root.asDiagonal() * evidence.information *
                                                              root.asDiagonal());
  const Eigen::VectorXd along = solver.eigenvectors().transpose() * (root.asDiagonal() * evidence.weighted);
  Eigen::VectorXd posterior(log_ratio.size());
  for (Eigen::Index i = 0; i < log_ratio.size(); ++i) {
    const double variance = std::pow(stated * std::exp(log_ratio[i]), 2);
    double sum = -0.5 * std::pow(log_ratio[i] / kPriorWidth, 2);
    for (Eigen::Index j = 0; j < along.size(); ++j) {
      const double known = 1 + variance * std::max(0.0, solver.eigenvalues()[j]);
      sum += 0.5 * (along[j] * along[j] * variance / known - std::log(known));
    }
    posterior[i] = sum;
  }
  return posterior;
}

/// Weight of each error's precision under a normal law and one of outliers, by its posterior mean square.
Eigen::VectorXd precisionOf(const ErrorEvidence& evidence, const Eigen::VectorXd& precision, double spread) {
  const double variance = spread * spread;
  const Eigen::MatrixXd covariance =
      regularised(evidence.information + Eigen::MatrixXd((precision / variance).asDiagonal()))
          .ldlt()
          .solve(Eigen::MatrixXd::Identity(precision.size(), precision.size()));
  const Eigen::VectorXd mean = covariance * evidence.weighted;
  Eigen::VectorXd next(precision.size());
  for (Eigen::Index i = 0; i < precision.size(); ++i) {
    const double square = (mean[i] * mean[i] + covariance(i, i)) / variance;
    const double wide = kOutlierWidth * kOutlierWidth;
    const double usual = (1 - kOutlierShare) * std::exp(-0.5 * square);
    const double outlier = kOutlierShare / kOutlierWidth * std::exp(-0.5 * square / wide);
    const double share = usual + outlier > 0 ? usual / (usual + outlier) : 0;
    next[i] = share + (1 - share) / wide;
  }
  return next;
}

/// Evidence of the globals [first, first + count), with all others refitted.
ErrorEvidence evidenceOf(const Scores& scores, const SessionLatents& latents, int first, int count) {
  std::vector<int> own(static_cast<std::size_t>(count)), rest;
  std::iota(own.begin(), own.end(), first);
  for (int j = 0; j < latents.globals(); ++j) {
    if (j < first || j >= first + count) rest.push_back(j);
  }
  const Eigen::MatrixXd across = scores.information(rest, own);
  const Eigen::MatrixXd projection = regularised(scores.information(rest, rest)).ldlt().solve(across);
  ErrorEvidence evidence;
  evidence.information = scores.information(own, own) - across.transpose() * projection;
  evidence.weighted = scores.total(own) - projection.transpose() * scores.total(rest);
  for (int i = 0; i < count; ++i) {
    const double prior = scores.prior[first + i], value = latents.global(first + i);
    evidence.information(i, i) -= prior;
    evidence.weighted[i] += prior * value;
  }
  Eigen::VectorXd values(count);
  for (int i = 0; i < count; ++i) values[i] = latents.global(first + i);
  evidence.weighted += evidence.information * values;
  return evidence;
}

/// [errors][errors] Covariance of errors that are normal about zero with this spread, given the evidence.
Eigen::MatrixXd posteriorCovariance(const ErrorEvidence& evidence, double spread) {
  const Eigen::Index count = evidence.weighted.size();
  const Eigen::MatrixXd precision = evidence.information + Eigen::MatrixXd::Identity(count, count) / (spread * spread);
  return regularised(precision).ldlt().solve(Eigen::MatrixXd::Identity(count, count));
}

PosteriorErrors errorsOf(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance) {
  PosteriorErrors errors;
  for (Eigen::Index i = 0; i < mean.size(); ++i) {
    errors.mean.push_back(mean[i]);
    errors.standard_deviation.push_back(std::sqrt(std::max(0.0, covariance(i, i))));
  }
  return errors;
}

}  // namespace

void ErrorEvidence::replace(int error, double value, double nats) {
  information.row(error).setZero();
  information.col(error).setZero();
  information(error, error) = 2 * nats / (value * value);
  weighted[error] = information(error, error) * value;
}

void ErrorEvidence::leaveOutCommon() {
  const Eigen::VectorXd common = information.rowwise().sum();
  const double all = common.sum();
  if (!(all > 0)) return;
  weighted -= common * (weighted.sum() / all);
  information -= common * common.transpose() / all;
}

std::optional<SpreadEstimate> estimatedSpread(const ErrorEvidence& evidence, double stated) {
  const Eigen::Index steps = static_cast<Eigen::Index>(2 * kGridSpan / kGridStep) + 1;
  const Eigen::VectorXd log_ratio = Eigen::VectorXd::LinSpaced(steps, -kGridSpan, kGridSpan);
  Eigen::VectorXd precision = Eigen::VectorXd::Ones(evidence.weighted.size());
  Eigen::VectorXd posterior;
  Eigen::Index best = 0;
  for (int i = 0; i < kReweightings; ++i) {
    posterior = logPosterior(evidence, precision, log_ratio, stated);
    posterior.maxCoeff(&best);
    precision = precisionOf(evidence, precision, stated * std::exp(log_ratio[best]));
  }
  const Eigen::VectorXd mass = (posterior.array() - posterior.maxCoeff()).exp();
  const double total = mass.sum();
  const double mean = mass.dot(log_ratio) / total;
  const double variance = (mass.array() * (log_ratio.array() - mean).square()).sum() / total;
  if (!(std::sqrt(variance) < kWidestPosterior)) return std::nullopt;
  const auto below = [&](double share) {
    double sum = 0;
    Eigen::Index i = 0;
    while (i + 1 < steps && (sum += mass[i]) < share * total) ++i;
    return stated * std::exp(log_ratio[i]);
  };
  return SpreadEstimate{stated * std::exp(log_ratio[best]), below(0.025), below(0.975)};
}

PosteriorErrors posteriorErrors(const ErrorEvidence& evidence, double spread) {
  const Eigen::MatrixXd covariance = posteriorCovariance(evidence, spread);
  return errorsOf(covariance * evidence.weighted, covariance);
}

PosteriorErrors errorsBesideCommon(ErrorEvidence evidence, double spread) {
  evidence.leaveOutCommon();
  const Eigen::VectorXd known = evidence.information.diagonal().cwiseMax(0.0);
  if (!(known.sum() > 0)) return posteriorErrors(evidence, spread);
  const Eigen::Index count = known.size();
  const Eigen::MatrixXd beside =
      Eigen::MatrixXd::Identity(count, count) - Eigen::VectorXd::Ones(count) * known.transpose() / known.sum();
  const Eigen::MatrixXd covariance = posteriorCovariance(evidence, spread);
  return errorsOf(beside * covariance * evidence.weighted, beside * covariance * beside.transpose());
}

ErrorEvidence rangeEvidence(const ChannelLikelihood& likelihood, const Basis& basis, const std::vector<int>& poses) {
  const Scores scores = likelihood.freeScores(basis, {}, poses);
  const int errors = static_cast<int>(basis.latents.actor_range_m.size());
  return evidenceOf(scores, basis.latents, basis.latents.globals() - errors, errors);
}

SessionEvidence errorEvidence(const ChannelLikelihood& likelihood, const std::vector<PoseEchoes>& echoes,
                              const SessionLatents& latents) {
  const Basis basis = likelihood.basis(echoes, latents, false);
  std::vector<int> every(basis.poses.size());
  std::iota(every.begin(), every.end(), 0);
  const Scores scores = likelihood.freeScores(basis, {}, every);
  SessionEvidence evidence;
  const int errors = static_cast<int>(latents.actor_gain.size());
  const int first = latents.globals() - 2 * errors;
  evidence.actor_gain = evidenceOf(scores, latents, first, errors);
  evidence.actor_range_m = evidenceOf(scores, latents, first + errors, errors);
  const Eigen::Index poses = static_cast<Eigen::Index>(basis.poses.size()), heading = latents.globals();
  evidence.yaw_rad.information = Eigen::MatrixXd::Zero(poses, poses);
  evidence.yaw_rad.weighted.resize(poses);
  for (Eigen::Index i = 0; i < poses; ++i) {
    const PoseBasis& pose = basis.poses[static_cast<std::size_t>(i)];
    const double information = pose.information(heading, heading);
    evidence.yaw_rad.information(i, i) = information;
    evidence.yaw_rad.weighted[i] = pose.score[heading] + information * latents.yaw_rad[static_cast<std::size_t>(i)];
  }
  return evidence;
}

}  // namespace mmradartwin::diagnosis::likelihood
