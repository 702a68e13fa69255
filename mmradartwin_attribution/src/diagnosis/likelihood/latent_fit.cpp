#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/likelihood/bounded_step.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/profiled_scores.h"

namespace mmradartwin::diagnosis::likelihood {
namespace {

/// Logarithm of the factor on uncertain paths from which a fit is tried again from 0, and the steps that it may take.
constexpr double kTrap = 1;
constexpr int kTrapSteps = 6;
constexpr double kYawStep_rad = 0.02, kMostYaw_rad = 0.06;  ///< longest step of a heading, largest heading error
constexpr double kLeastStep_nats = 0.1;                     ///< expected gain of a step below which fit() ends
constexpr double kLeastGain_nats = 0.01;                    ///< gain of a step below which fit() ends

}  // namespace

SessionLatents ChannelLikelihood::stepped(const SessionLatents& from, const Eigen::VectorXd& g, const Scores& scores,
                                          const Eigen::VectorXd& whole_step, double share) const {
  SessionLatents latents = from;
  const Bounds bounds = stepBounds(from);
  for (int j = 0; j < latents.globals(); ++j) {
    const Limits limits = limitsOf(j, errors_, spread_);
    const double change = share * std::clamp(g[j], bounds.low[j], bounds.high[j]);
    latents.global(j) = std::clamp(from.global(j) + change, limits.low, limits.high);
  }
  for (std::size_t i = 0; i < latents.yaw_rad.size(); ++i) {
    const double step =
        scores.yaw_step[i] - scores.yaw_coupling.row(static_cast<Eigen::Index>(i)).dot(whole_step.transpose());
    latents.yaw_rad[i] = std::clamp(latents.yaw_rad[i] + std::clamp(share * step, -kYawStep_rad, kYawStep_rad),
                                    -kMostYaw_rad, kMostYaw_rad);
  }
  return latents;
}

SessionLatents ChannelLikelihood::extrapolated(const SessionLatents& from, const SessionLatents& here,
                                               const SessionLatents& there, double share) const {
  SessionLatents latents = from;
  for (int j = 0; j < latents.globals(); ++j) {
    const Limits limits = limitsOf(j, errors_, spread_);
    latents.global(j) =
        std::clamp(from.global(j) + share * (there.global(j) - here.global(j)), limits.low, limits.high);
  }
  for (std::size_t i = 0; i < latents.yaw_rad.size(); ++i) {
    latents.yaw_rad[i] =
        std::clamp(from.yaw_rad[i] + share * (there.yaw_rad[i] - here.yaw_rad[i]), -kMostYaw_rad, kMostYaw_rad);
  }
  return latents;
}

ChannelLikelihood::Bounds ChannelLikelihood::stepBounds(const SessionLatents& from) const {
  Bounds bounds{Eigen::VectorXd(from.globals()), Eigen::VectorXd(from.globals())};
  for (int j = 0; j < from.globals(); ++j) {
    const Limits limits = limitsOf(j, errors_, spread_);
    bounds.low[j] = std::clamp(limits.low - from.global(j), -limits.step, 0.0);
    bounds.high[j] = std::clamp(limits.high - from.global(j), 0.0, limits.step);
  }
  return bounds;
}

double ChannelLikelihood::fit(const std::vector<PoseEchoes>& echoes, SessionLatents& latents, int iterations) const {
  double best = -1e300;
  std::vector<int> all(echoes.size());
  std::iota(all.begin(), all.end(), 0);
  for (int i = 0; i < iterations; ++i) {
    const Scores derivatives = scores(basis(echoes, latents, false), {}, all);
    best = derivatives.log_likelihood;
    const Bounds bounds = stepBounds(latents);
    const auto [step, promised_nats] =
        boundedStep(regularised(derivatives.information), derivatives.total, bounds.low, bounds.high);
    bool better = false;
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(step.size());
    // All numbers together; where that fails, headings alone, then globals alone.
    for (int attempt = 0; attempt < 6 && !better; ++attempt) {
      constexpr double kShares[] = {1.0, 0.5, 0.2, 0.05};
      SessionLatents next = attempt < 4    ? stepped(latents, step, derivatives, step, kShares[attempt])
                            : attempt == 4 ? stepped(latents, none, derivatives, none, 1)
                                           : stepped(latents, step, derivatives, step, 0.5);
      if (attempt == 5) next.yaw_rad = latents.yaw_rad;
      const double value = logLikelihood(echoes, next);
      if (value <= best) continue;
      latents = std::move(next);
      best = value;
      better = true;
    }
    if (best - derivatives.log_likelihood < kLeastGain_nats || promised_nats < kLeastStep_nats) break;
  }
  return best;
}

double ChannelLikelihood::fitWithoutTrap(const std::vector<PoseEchoes>& echoes, SessionLatents& latents,
                                         double reached) const {
  if (latents.log_pose_sensitive < kTrap) return reached;
  SessionLatents other = latents;
  other.log_pose_sensitive = 0;
  const double there = fit(echoes, other, kTrapSteps);
  if (there <= reached) return reached;
  latents = std::move(other);
  return there;
}

SessionLatents ChannelLikelihood::start(const std::vector<PoseEchoes>& echoes) const {
  SessionLatents latents;
  latents.actor_gain.assign(static_cast<std::size_t>(errors_), 0.0);
  latents.actor_range_m.assign(static_cast<std::size_t>(errors_), 0.0);
  latents.yaw_rad.assign(data_.poses.size(), 0.0);
  // Gain: median over poses of measured over expected power. Floor: lower quartile over cells of power over clutter.
  std::vector<double> ratio, low;
  for (std::size_t i = 0; i < echoes.size(); ++i) {
    double expected = 0;
    for (const auto& group : echoes[i].groups) {
      const EchoGroup& g = *group;
      for (int bin = std::max(firstBin(), g.bins.first); bin < g.bins.first + g.bins.cells; ++bin) {
        const auto* p = g.bins.at(bin, size_)->power;
        for (int k = 0; k < channels_; ++k) expected += p[static_cast<std::size_t>(k) * (k + 3) / 2].real();
      }
    }
    double measured = 0;
    for (int bin = firstBin(); bin < samples_; ++bin) {
      const double power = data_.poses[i].range_spectra.col(bin).squaredNorm();
      measured += power;
      low.push_back(std::log(power / channels_ + 1e-300) -
                    std::log(data_.poses[i].clutter.at(bin, size_)[0].real() + 1e-300));
    }
    if (expected > 0) ratio.push_back(std::log(measured / expected));
  }
  const auto quantile = [](std::vector<double>& v, double share) {
    if (v.empty()) return 0.0;
    const auto at = v.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(v.size() - 1));
    std::nth_element(v.begin(), at, v.end());
    return *at;
  };
  latents.log_gain = quantile(ratio, 0.5);
  latents.log_floor = quantile(low, 0.25);
  // Large independent errors to start with: outliers of a narrow t distribution would give headings no slope.
  latents.log_relative = -3;
  return latents;
}

}  // namespace mmradartwin::diagnosis::likelihood
