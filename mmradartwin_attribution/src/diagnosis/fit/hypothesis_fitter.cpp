#include "diagnosis/fit/hypothesis_fitter.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <numeric>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/fit/likelihood_climb.h"
#include "diagnosis/hypotheses/evidence_bounds.h"
#include "diagnosis/likelihood/profiled_scores.h"

namespace mmradartwin::diagnosis::fit {
namespace {

constexpr int kSteps = 4, kStepsTogether = 3;  ///< Fisher steps of one hypothesis, of several jointly
/// Fisher steps of the latents, from the data and from other latents.
constexpr int kFreshSteps = 14, kFurtherSteps = 3;
constexpr int kMostExpansions = 8;   ///< rounds in which a state's echoes are collected about the fitted ranges
constexpr double kSettled_nats = 1;  ///< gain of a round below which these rounds end
/// Shares of a fold's step that are tried until its places lose nothing.
constexpr double kFoldShares[] = {1, 0.4, 0.1, 0};
constexpr double kLeastShareKept = 0.2;  ///< lower limit of the share of places that a fold is fitted to

}  // namespace

HypothesisFitter::HypothesisFitter(ExpectedEchoes& source, const ChannelLikelihood& model, int folds,
                                   StatedBounds stated)
    : source_(source), model_(model), folds_(folds), stated_(stated) {}

ModelState HypothesisFitter::state(const std::vector<NamedParameters>& mechanisms, const SessionLatents* start) {
  ModelState state;
  state.mechanisms = mechanisms;
  if (start != nullptr) state.actor_range_m = start->actor_range_m;
  state.echoes = source_.echoes(mechanisms, state.actor_range_m);
  state.latents = start != nullptr ? *start : model_.start(state.echoes);
  double reached = model_.fit(state.echoes, state.latents, start != nullptr ? kFurtherSteps : kFreshSteps);
  reached = model_.fitWithoutTrap(state.echoes, state.latents, reached);
  // Echoes depend on ranges to first order only, so that they are collected again about the fitted ranges. A null below
  // its optimum would lend its missing nats to every hypothesis.
  for (int i = 0; i < kMostExpansions; ++i) {
    const double before = reached;
    state.actor_range_m = state.latents.actor_range_m;
    state.echoes = source_.echoes(mechanisms, state.actor_range_m);
    reached = model_.fit(state.echoes, state.latents, kFurtherSteps);
    if (i > 0 && reached < before + kSettled_nats) break;
  }
  state.log_likelihood = model_.logLikelihood(state.echoes, state.latents, &state.by_pose);
  state.basis = model_.basis(state.echoes, state.latents);
  state.covariance = model_.covariance(state.echoes, state.latents, everyPose(state));
  return state;
}

std::optional<ModelState> HypothesisFitter::improved(const ModelState& null, const SessionLatents& latents) {
  SessionLatents other = latents;
  Eigen::VectorXd apart(latents.globals());
  for (int j = 0; j < latents.globals(); ++j) apart[j] = latents.global(j) - null.latents.global(j);
  const Eigen::MatrixXd information = model_.scores(null.basis, {}, everyPose(null)).information;
  if (0.5 * apart.dot(information * apart) < bounds::kSameOptimum_nats) return std::nullopt;
  const auto echoes = source_.echoes(null.mechanisms, other.actor_range_m);
  model_.fit(echoes, other, kFurtherSteps);
  if (model_.logLikelihood(echoes, other) < null.log_likelihood + bounds::kLeastNatsOfBetterLatents)
    return std::nullopt;
  ModelState s = state(null.mechanisms, &other);
  if (s.log_likelihood < null.log_likelihood + bounds::kLeastNatsOfBetterLatents) return std::nullopt;
  return s;
}

Eigen::MatrixXd HypothesisFitter::robustCovariance(const ProfiledScores& e) const {
  const double locations = static_cast<double>(e.by_location.rows());
  const Eigen::MatrixXd covariance = e.information.inverse();
  if (locations <= 2) return covariance;
  Eigen::MatrixXd robust = covariance * e.scatter * covariance;
  for (Eigen::Index j = 0; j < robust.rows(); ++j) {  // at least the likelihood's own variance
    const double factor = std::sqrt(std::max(1.0, covariance(j, j) / robust(j, j)));
    robust.row(j) *= factor;
    robust.col(j) *= factor;
  }
  return robust;
}

EvidenceShare HypothesisFitter::evidenceOfPresence(const std::vector<NamedParameters>& base,
                                                   const std::vector<Hypothesis>& parts, const Optimum& o,
                                                   const ProfiledScores& e, Eigen::Index first, Eigen::Index numbers) {
  std::vector<double> scaled_values = o.scaled_values;
  std::fill_n(scaled_values.begin() + first, numbers, 0.0);
  const double gain =
      gainWithoutBestPlace(model_.data(), state(mechanismsWith(base, parts, scaled_values), &o.state.latents), o.state);
  if (e.scatter.size() == 0) return {gain, 1};  // one place has no scatter
  return {gain, std::clamp(e.scatter(first, first) / e.information(first, first), 1.0, kMostOverdispersion)};
}

EvidenceShare HypothesisFitter::evidenceShareOf(const Hypothesis& hypothesis, const Eigen::VectorXd& scaled_values,
                                                const Eigen::MatrixXd& covariance,
                                                const Eigen::MatrixXd& robust) const {
  const double by_likelihood = 0.5 * scaled_values.dot(covariance.ldlt().solve(scaled_values));
  const double by_scatter = 0.5 * scaled_values.dot(robust.ldlt().solve(scaled_values));
  if (!(by_scatter > 0)) return {};
  return {by_likelihood, shrunkOverdispersion(by_likelihood / by_scatter, hypothesis, model_.data().locations.size())};
}

JointFit HypothesisFitter::refit(const std::vector<NamedParameters>& base, const SessionLatents& latents,
                                 const std::vector<Hypothesis>& parts, const std::vector<std::vector<double>>& start) {
  std::vector<std::vector<double>> starts = {{}};
  for (const std::vector<double>& s : start) starts[0].insert(starts[0].end(), s.begin(), s.end());
  Optimum optimum = LikelihoodClimb(source_, model_, {base, latents, parts, starts, kStepsTogether}).run();
  const ProfiledScores profiled = profiledScores(optimum.scores, latents.globals());
  const Eigen::MatrixXd covariance = profiled.information.inverse(), robust = robustCovariance(profiled);
  JointFit fit;
  Eigen::Index at = 0;
  for (const Hypothesis& hypothesis : parts) {
    const Eigen::Index n = static_cast<Eigen::Index>(hypothesis.coordinates.size());
    const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(optimum.scaled_values.data() + at, n);
    fit.scaled_values.emplace_back(v.data(), v.data() + n);
    std::vector<double> errors;
    for (Eigen::Index j = 0; j < n; ++j) {
      const Coordinate& c = hypothesis.coordinates[static_cast<std::size_t>(j)];
      errors.push_back(std::sqrt(robust(at + j, at + j)) * std::abs(c.slope(v[j])));
    }
    fit.standard_error.push_back(std::move(errors));
    EvidenceShare evidence;
    if (n > 0 && !hypothesis.isOneSided())
      evidence = evidenceShareOf(hypothesis, v, covariance.block(at, at, n, n), robust.block(at, at, n, n));
    // A turn of the view lets paths in and out, which no slope shows.
    const bool turns = hypothesis.isGeometry() && n == 1 && source_.altersGeometry(hypothesis.at({1.0}));
    if (n > 0 && (hypothesis.isOneSided() || turns)) {
      const EvidenceShare presence = evidenceOfPresence(base, parts, optimum, profiled, at, n);
      if (hypothesis.isOneSided() || presence.scattered() > evidence.scattered()) evidence = presence;
    }
    fit.evidence.push_back(evidence);
    at += n;
  }
  fit.latents = std::move(optimum.state.latents);
  return fit;
}

HypothesisFit HypothesisFitter::fit(const ModelState& null, const Hypothesis& hypothesis,
                                    const std::vector<std::vector<double>>& starts, double least_nats,
                                    const HypothesisFit* known) {
  HypothesisFit fit;
  fit.stated = stated_;
  fit.hypothesis = hypothesis;
  const int globals = null.latents.globals();
  const Eigen::Index n = static_cast<Eigen::Index>(hypothesis.coordinates.size());
  const std::vector<Hypothesis> parts = {hypothesis};
  const SessionLatents& latents = known != nullptr ? known->state.latents : null.latents;
  Optimum o = LikelihoodClimb(source_, model_,
                              {null.mechanisms, latents, parts, starts, kSteps, &null,
                               std::max(kLeastForSearch_nats, least_nats), known})
                  .run();
  fit.scaled_values = std::move(o.scaled_values);
  fit.state = std::move(o.state);
  fit.state.echoes = {};  // they need 80 MB and more per fit at 154 poses
  const Scores& scores = o.scores;
  gainOver(null, fit);
  const std::vector<double> gain_at = gainByLocation(model_.data(), null, fit.state);

  // Scatter over places is that of the scores at the fit, or that of the gain where there are no coordinates.
  const double locations = static_cast<double>(gain_at.size());
  if (n > 0) {
    const ProfiledScores profiled = profiledScores(scores, globals);
    fit.overdispersion = shrunkOverdispersion(profiled.overdispersion, hypothesis, model_.data().locations.size());
    const Eigen::MatrixXd covariance = profiled.information.inverse(), robust = robustCovariance(profiled);
    for (Eigen::Index j = 0; j < n; ++j) {
      fit.standard_error.push_back(std::sqrt(robust(j, j)) *
                                   std::abs(hypothesis.coordinates[static_cast<std::size_t>(j)].slope(
                                       fit.scaled_values[static_cast<std::size_t>(j)])));
    }
    // Values without a fold lie one step from the fit, by the scores of the other folds.
    for (int k = 0; k < folds_; ++k) {
      Eigen::VectorXd left_out = Eigen::VectorXd::Zero(n);
      double share = 0;
      for (Eigen::Index l = 0; l < profiled.by_location.rows(); ++l) {
        if (fold(static_cast<int>(l)) != k) continue;
        left_out += profiled.by_location.row(l).transpose();
        share += 1 / locations;
      }
      const Eigen::VectorXd shift = covariance * left_out / std::max(kLeastShareKept, 1 - share);
      std::vector<double> scaled_values = fit.scaled_values;
      for (Eigen::Index j = 0; j < n; ++j) scaled_values[static_cast<std::size_t>(j)] -= shift[j];
      fit.fold_scaled.push_back(scaled_values);
      fit.held_out_gain -= left_out.dot(shift) + 0.5 * share * shift.dot(profiled.information * shift);
    }
  } else {
    fit.fold_scaled.assign(static_cast<std::size_t>(folds_), {});
    fit.overdispersion = overdispersionOfPresence(fit.gain, gain_at);
  }
  return fit;
}

void HypothesisFitter::shortenFoldSteps(const ModelState& null, HypothesisFit& fit) {
  if (fit.scaled_values.empty()) return;
  for (int k = 0; k < folds_; ++k) {
    std::vector<int> poses;
    double fitted = 0;
    for (std::size_t i = 0; i < fit.state.by_pose.size(); ++i) {
      if (fold(model_.data().poses[i].location) == k) continue;
      poses.push_back(static_cast<int>(i));
      fitted += fit.state.by_pose[i];
    }
    std::vector<double>& fold = fit.fold_scaled[static_cast<std::size_t>(k)];
    const std::vector<double> whole = fold;
    for (double share : kFoldShares) {
      for (std::size_t j = 0; j < fold.size(); ++j)
        fold[j] = fit.scaled_values[j] + share * (whole[j] - fit.scaled_values[j]);
      const auto echoes =
          source_.echoes(mechanismsWith(null.mechanisms, {fit.hypothesis}, fold), poses, fit.state.actor_range_m);
      const std::vector<double> there = model_.byPose(echoes, fit.state.latents, poses);
      if (std::accumulate(there.begin(), there.end(), 0.0) >= fitted) break;
    }
  }
  source_.setBaseline(null.mechanisms);
}

void HypothesisFitter::gainOver(const ModelState& null, HypothesisFit& f) const {
  const double before = f.gain;
  f.gain = f.state.log_likelihood - null.log_likelihood;
  f.gain_without_best_place = gainWithoutBestPlace(model_.data(), null, f.state);
  f.held_out_gain += f.gain - before;
}

bool HypothesisFitter::isOverwhelming(double nats) const {
  return nats > bounds::kOverwhelming_nats_per_pose * static_cast<double>(model_.data().poses.size());
}

void HypothesisFitter::judge(HypothesisFit& f, std::size_t family) const {
  f.false_alarm_rate = falseAlarmRate(f.gain_without_best_place / f.overdispersion, f.hypothesis, f.numbers(), family);
  f.overwhelming = isOverwhelming(f.gain_without_best_place);
  if (f.overwhelming) f.false_alarm_rate = std::min(f.false_alarm_rate, bounds::kFalseAlarmRateOfOverwhelming);
}

double HypothesisFitter::falseAlarmRate(double gain, const Hypothesis& hypothesis, std::size_t numbers,
                                        std::size_t family) const {
  // Twice the gain per number follows a moderated F distribution (Smyth 2004). The overdispersion, by which the gain
  // was divided, was estimated from the places, less the fitted coordinates, and from the usual scatter.
  const double n = static_cast<double>(std::max<std::size_t>(1, numbers));
  const double followed = static_cast<double>(hypothesis.coordinates.size());
  const double places = static_cast<double>(model_.data().locations.size()) + usualScatter(hypothesis).places;
  const boost::math::fisher_f distribution(n, std::max(1.0, places - followed));
  const double statistic = 2 * std::max(0.0, gain) / n;
  return std::min(1.0,
                  static_cast<double>(family) * boost::math::cdf(boost::math::complement(distribution, statistic)));
}

}  // namespace mmradartwin::diagnosis::fit
