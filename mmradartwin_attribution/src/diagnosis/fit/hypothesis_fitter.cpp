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

constexpr int kSteps = 4, kStepsTogether = 3;       ///< Fisher steps of one hypothesis, of several together
constexpr int kFirstSteps = 14, kFurtherSteps = 3;  ///< Fisher steps of the latents, from scratch and from others
constexpr int kMostExpansions = 8;                  ///< of a state's echoes about the ranges that were fitted
constexpr double kSettled_nats = 1;                 ///< gain of an expansion below which they end
constexpr double kFoldShares[] = {1, 0.4, 0.1, 0};  ///< of a fold's step, until its places are no worse
constexpr double kLeastShareKept = 0.2;             ///< bound of the share of places that a fold is fitted to

}  // namespace

HypothesisFitter::HypothesisFitter(ExpectedEchoes& source, const ChannelLikelihood& model, int folds,
                                   StatedBounds stated)
    : source_(source), model_(model), folds_(folds), stated_(stated) {}

ModelState HypothesisFitter::state(const std::vector<NamedParameters>& mechanisms, const SessionLatents* start) {
  ModelState s;
  s.mechanisms = mechanisms;
  if (start != nullptr) s.actor_range_m = start->actor_range_m;
  s.echoes = source_.echoes(mechanisms, s.actor_range_m);
  s.nuisance = start != nullptr ? *start : model_.start(s.echoes);
  double reached = model_.fit(s.echoes, s.nuisance, start != nullptr ? kFurtherSteps : kFirstSteps);
  // Echoes depend on ranges to first order only: they are collected again about the fitted ranges. Nats left below the
  // top would count as a gain of whatever is tried next.
  for (int i = 0; i < kMostExpansions; ++i) {
    const double before = reached;
    s.actor_range_m = s.nuisance.actor_range_m;
    s.echoes = source_.echoes(mechanisms, s.actor_range_m);
    reached = model_.fit(s.echoes, s.nuisance, kFurtherSteps);
    if (i > 0 && reached < before + kSettled_nats) break;
  }
  s.log_likelihood = model_.logLikelihood(s.echoes, s.nuisance, &s.by_pose);
  s.basis = model_.basis(s.echoes, s.nuisance);
  s.covariance = model_.covariance(s.echoes, s.nuisance, everyPose(s));
  return s;
}

std::optional<ModelState> HypothesisFitter::improved(const ModelState& null, const SessionLatents& latents) {
  SessionLatents other = latents;
  Eigen::VectorXd apart(latents.globals());
  for (int j = 0; j < latents.globals(); ++j) apart[j] = latents.global(j) - null.nuisance.global(j);
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

EvidenceShare HypothesisFitter::worthOfPresence(const std::vector<NamedParameters>& base,
                                                const std::vector<Hypothesis>& parts, const Optimum& o,
                                                const ProfiledScores& e, Eigen::Index first, Eigen::Index numbers) {
  std::vector<double> scaled_values = o.scaled_values;
  std::fill_n(scaled_values.begin() + first, numbers, 0.0);
  const double gain =
      broadGain(model_.data(), state(mechanismsWith(base, parts, scaled_values), &o.state.nuisance), o.state);
  if (e.scatter.size() == 0) return {gain, 1};  // one place: nothing scatters
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

JointFit HypothesisFitter::refit(const std::vector<NamedParameters>& base, const SessionLatents& nuisance,
                                 const std::vector<Hypothesis>& parts, const std::vector<std::vector<double>>& start) {
  std::vector<std::vector<double>> starts = {{}};
  for (const std::vector<double>& s : start) starts[0].insert(starts[0].end(), s.begin(), s.end());
  Optimum o = LikelihoodClimb(source_, model_, {base, nuisance, parts, starts, kStepsTogether}).run();
  const ProfiledScores e = profiledScores(o.scores, nuisance.globals());
  const Eigen::MatrixXd covariance = e.information.inverse(), robust = robustCovariance(e);
  JointFit fit;
  Eigen::Index at = 0;
  for (const Hypothesis& h : parts) {
    const Eigen::Index n = static_cast<Eigen::Index>(h.coordinates.size());
    const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(o.scaled_values.data() + at, n);
    fit.scaled_values.emplace_back(v.data(), v.data() + n);
    std::vector<double> errors;
    for (Eigen::Index j = 0; j < n; ++j) {
      const Coordinate& c = h.coordinates[static_cast<std::size_t>(j)];
      errors.push_back(std::sqrt(robust(at + j, at + j)) * std::abs(c.slope(v[j])));
    }
    fit.standard_error.push_back(std::move(errors));
    EvidenceShare worth;
    if (n > 0 && !h.isOneSided())
      worth = evidenceShareOf(h, v, covariance.block(at, at, n, n), robust.block(at, at, n, n));
    // Paths that a turn of the view lets in and out show in no slope.
    const bool turns = h.isGeometry() && n == 1 && source_.altersGeometry(h.at({1.0}));
    if (n > 0 && (h.isOneSided() || turns)) {
      const EvidenceShare presence = worthOfPresence(base, parts, o, e, at, n);
      if (h.isOneSided() || presence.scattered() > worth.scattered()) worth = presence;
    }
    fit.worth.push_back(worth);
    at += n;
  }
  fit.nuisance = std::move(o.state.nuisance);
  return fit;
}

HypothesisFit HypothesisFitter::fit(const ModelState& null, const Hypothesis& hypothesis,
                                    const std::vector<std::vector<double>>& starts, double least_nats,
                                    const HypothesisFit* known) {
  HypothesisFit f;
  f.stated = stated_;
  f.hypothesis = hypothesis;
  const int globals = null.nuisance.globals();
  const Eigen::Index n = static_cast<Eigen::Index>(hypothesis.coordinates.size());
  const std::vector<Hypothesis> parts = {hypothesis};
  const SessionLatents& latents = known != nullptr ? known->state.nuisance : null.nuisance;
  Optimum o = LikelihoodClimb(source_, model_,
                              {null.mechanisms, latents, parts, starts, kSteps, &null,
                               std::max(kWorthASearch_nats, least_nats), known})
                  .run();
  f.scaled_values = std::move(o.scaled_values);
  f.state = std::move(o.state);
  f.state.echoes = {};  // 80 MB and more a fit, of 154 poses
  const Scores& scores = o.scores;
  gainOver(null, f);
  const std::vector<double> gain_at = gainByLocation(model_.data(), null, f.state);

  // Scatter over places is that of the scores at the fit, or of the gain where nothing has a slope.
  const double locations = static_cast<double>(gain_at.size());
  if (n > 0) {
    const ProfiledScores e = profiledScores(scores, globals);
    f.overdispersion = shrunkOverdispersion(e.overdispersion, hypothesis, model_.data().locations.size());
    const Eigen::MatrixXd covariance = e.information.inverse(), robust = robustCovariance(e);
    for (Eigen::Index j = 0; j < n; ++j) {
      f.standard_error.push_back(std::sqrt(robust(j, j)) *
                                 std::abs(hypothesis.coordinates[static_cast<std::size_t>(j)].slope(
                                     f.scaled_values[static_cast<std::size_t>(j)])));
    }
    // Values without a fold lie one step away from the fit, by that fold's scores.
    for (int k = 0; k < folds_; ++k) {
      Eigen::VectorXd left_out = Eigen::VectorXd::Zero(n);
      double share = 0;
      for (Eigen::Index l = 0; l < e.by_location.rows(); ++l) {
        if (fold(static_cast<int>(l)) != k) continue;
        left_out += e.by_location.row(l).transpose();
        share += 1 / locations;
      }
      const Eigen::VectorXd shift = covariance * left_out / std::max(kLeastShareKept, 1 - share);
      std::vector<double> scaled_values = f.scaled_values;
      for (Eigen::Index j = 0; j < n; ++j) scaled_values[static_cast<std::size_t>(j)] -= shift[j];
      f.fold_scaled.push_back(scaled_values);
      f.held_out_gain -= left_out.dot(shift) + 0.5 * share * shift.dot(e.information * shift);
    }
  } else {
    f.fold_scaled.assign(static_cast<std::size_t>(folds_), {});
    f.overdispersion = overdispersionOfPresence(f.gain, gain_at);
  }
  return f;
}

void HypothesisFitter::settleFolds(const ModelState& null, HypothesisFit& f) {
  if (f.scaled_values.empty()) return;
  for (int k = 0; k < folds_; ++k) {
    std::vector<int> poses;
    double fitted = 0;
    for (std::size_t i = 0; i < f.state.by_pose.size(); ++i) {
      if (fold(model_.data().poses[i].location) == k) continue;
      poses.push_back(static_cast<int>(i));
      fitted += f.state.by_pose[i];
    }
    std::vector<double>& fold = f.fold_scaled[static_cast<std::size_t>(k)];
    const std::vector<double> whole = fold;
    for (double share : kFoldShares) {
      for (std::size_t j = 0; j < fold.size(); ++j)
        fold[j] = f.scaled_values[j] + share * (whole[j] - f.scaled_values[j]);
      const auto echoes =
          source_.echoes(mechanismsWith(null.mechanisms, {f.hypothesis}, fold), poses, f.state.actor_range_m);
      const std::vector<double> there = model_.byPose(echoes, f.state.nuisance, poses);
      if (std::accumulate(there.begin(), there.end(), 0.0) >= fitted) break;
    }
  }
  source_.setBaseline(null.mechanisms);
}

void HypothesisFitter::gainOver(const ModelState& null, HypothesisFit& f) const {
  const double before = f.gain;
  f.gain = f.state.log_likelihood - null.log_likelihood;
  f.gain_without_best_place = broadGain(model_.data(), null, f.state);
  f.held_out_gain += f.gain - before;
}

bool HypothesisFitter::isPlain(double nats) const {
  return nats > bounds::kPlain_nats_per_pose * static_cast<double>(model_.data().poses.size());
}

void HypothesisFitter::judge(HypothesisFit& f, std::size_t family) const {
  f.false_alarm_rate = falseAlarmRate(f.gain_without_best_place / f.overdispersion, f.hypothesis, f.numbers(), family);
  f.plain = isPlain(f.gain_without_best_place);
  if (f.plain) f.false_alarm_rate = std::min(f.false_alarm_rate, bounds::kFalseAlarmRateOfPlain);
}

double HypothesisFitter::falseAlarmRate(double gain, const Hypothesis& hypothesis, std::size_t numbers,
                                        std::size_t family) const {
  // Twice the gain per number follows a moderated F distribution (Smyth 2004). The overdispersion that the gain was
  // divided by was estimated from the places, less the fitted coordinates, and from the usual scatter.
  const double n = static_cast<double>(std::max<std::size_t>(1, numbers));
  const double followed = static_cast<double>(hypothesis.coordinates.size());
  const double places = static_cast<double>(model_.data().locations.size()) + usualScatter(hypothesis).places;
  const boost::math::fisher_f distribution(n, std::max(1.0, places - followed));
  const double statistic = 2 * std::max(0.0, gain) / n;
  return std::min(1.0,
                  static_cast<double>(family) * boost::math::cdf(boost::math::complement(distribution, statistic)));
}

}  // namespace mmradartwin::diagnosis::fit
