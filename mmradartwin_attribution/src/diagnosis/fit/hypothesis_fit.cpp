#include "diagnosis/fit/hypothesis_fit.h"

#include <nlopt.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/hypotheses/evidence_bounds.h"
#include "diagnosis/likelihood/profiled_scores.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::fit {
namespace {

constexpr int kSteps = 4, kStepsTogether = 3;       ///< Fisher steps of one hypothesis, of several together
constexpr int kFirstSteps = 14, kFurtherSteps = 3;  ///< Fisher steps of the latents, from scratch and from others
constexpr int kRisingFactor = 12;                   ///< times as many steps while each still gains kRising_nats
constexpr double kLeastStep_nats = 0.2;             ///< promised gain below which a climb ends
constexpr int kMostExpansions = 8;                  ///< of a state's echoes about the ranges that were fitted
constexpr double kSettled_nats = 1;                 ///< gain of an expansion below which they end
constexpr double kRising_nats = 5;                  ///< gain of the last step for which a climb goes on
constexpr double kClimb_steps = 4;                  ///< like the last one, within which a climb has to reach its gain
constexpr double kWorthASearch_nats = 25;           ///< gain by slopes from which on a rough likelihood is searched
constexpr double kSearched[] = {0.3, 0.15};         ///< first steps of that search, in the coordinates' scale
constexpr double kSearchTolerance = 0.02;           ///< in the coordinates' scale
constexpr int kSearchPlaces = 12;                   ///< per coordinate
constexpr double kLongestStep = 3;                  ///< in the coordinate's scale
constexpr double kStepShares[] = {1.0, 0.4, 0.1};   ///< of a promised step, until one gains
constexpr double kOneSidedFactors[] = {0.4, 2.0};   ///< of a start that rises from nothing
constexpr Eigen::Index kMostRough = 4;              ///< coordinates that are searched without slopes
constexpr double kFoldShares[] = {1, 0.4, 0.1, 0};  ///< of a fold's step, until its places are no worse
constexpr double kLeastShareKept = 0.2;

/// Calls `value` at places that lead to its maximum, without slopes (BOBYQA, Powell 2009).
void searchQuadratically(const std::vector<Coordinate>& coordinates, std::vector<double> scaled_values,
                         double initial_step, const std::function<double(const std::vector<double>&)>& value) {
  const unsigned n = static_cast<unsigned>(coordinates.size());
  const std::unique_ptr<std::remove_pointer_t<nlopt_opt>, void (*)(nlopt_opt)> search(nlopt_create(NLOPT_LN_BOBYQA, n),
                                                                                      nlopt_destroy);
  std::vector<double> low, high;
  for (const Coordinate& c : coordinates) {
    low.push_back(std::min(c.scaled(c.min), c.scaled(c.max)));
    high.push_back(std::max(c.scaled(c.min), c.scaled(c.max)));
  }
  const auto call = [](unsigned size, const double* x, double*, void* function) {
    return (*static_cast<const std::function<double(const std::vector<double>&)>*>(function))({x, x + size});
  };
  nlopt_set_lower_bounds(search.get(), low.data());
  nlopt_set_upper_bounds(search.get(), high.data());
  nlopt_set_max_objective(search.get(), call, const_cast<std::function<double(const std::vector<double>&)>*>(&value));
  nlopt_set_initial_step1(search.get(), initial_step);
  nlopt_set_xtol_abs1(search.get(), kSearchTolerance);
  nlopt_set_maxeval(search.get(), kSearchPlaces * static_cast<int>(n));
  double best = 0;
  nlopt_optimize(search.get(), scaled_values.data(), &best);
}

}  // namespace

std::vector<int> everyPose(const ModelState& state) {
  std::vector<int> poses(state.echoes.size());
  std::iota(poses.begin(), poses.end(), 0);
  return poses;
}

std::size_t HypothesisFit::numbers() const {
  return std::max<std::size_t>(1, hypothesis.coordinates.size()) + static_cast<std::size_t>(hypothesis.searched);
}

double HypothesisFit::ranking() const {
  const NamedParameters& m = hypothesis.mechanism;
  const bool nests = m.mechanism == "empirical_law" &&
                     !(m.values.numbers("channels").empty() && m.values.numbers("angle_deg").empty());
  const double share = nests                        ? bounds::kRankedShareOfNestingLaw
                       : !isCatalogued(m.mechanism) ? bounds::kRankedShareOfLaw
                       : hypothesis.searched > 1    ? bounds::kRankedShareOfSteps
                                                    : 1;
  double nats = share * gain - bounds::kPriceOfNumber_nats * static_cast<double>(numbers());
  if (hypothesis.mechanism.mechanism == "actor_unmodelled") nats -= bounds::kPriceOfPlace_nats;
  if (hypothesis.isMove() && moved_m() < stated.leastMove_m()) nats -= bounds::kPriceOfNumber_nats;
  return nats;
}

double HypothesisFit::moved_m() const {
  if (hypothesis.isMove()) {
    const NamedParameters m = hypothesis.at(scaled_values);
    return std::hypot(m.values.number("dx_m"), m.values.number("dy_m"));
  }
  double all_by_m = 0;
  for (std::size_t i = 0; hypothesis.isGeometry() && i < scaled_values.size(); ++i) {
    const Coordinate& c = hypothesis.coordinates[i];
    if (c.unit == "m") all_by_m = std::hypot(all_by_m, c.value(scaled_values[i]) - c.neutral);
  }
  return all_by_m;
}

bool HypothesisFit::isFarAway() const {
  return moved_m() > stated.farAway_m() &&
         (plain || gain_without_best_place / overdispersion > bounds::kLeastNatsOfFarAway);
}

double HypothesisFit::size_m() const {
  if (hypothesis.mechanism.mechanism != "actor_unmodelled") return 0;
  return hypothesis.at(scaled_values).values.number("size_m");
}

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

HypothesisFitter::Optimum HypothesisFitter::maximise(const std::vector<NamedParameters>& base,
                                                     const SessionLatents& nuisance,
                                                     const std::vector<Hypothesis>& parts,
                                                     const std::vector<std::vector<double>>& starts, int steps,
                                                     const ModelState* null, double least_nats,
                                                     const HypothesisFit* known) {
  std::vector<Coordinate> coordinates;
  for (const Hypothesis& h : parts) coordinates.insert(coordinates.end(), h.coordinates.begin(), h.coordinates.end());
  const int globals = nuisance.globals();
  const Eigen::Index n = static_cast<Eigen::Index>(coordinates.size());
  const auto mechanisms = [&](const std::vector<double>& at) { return mechanismsWith(base, parts, at); };
  const auto evaluate = [&](const std::vector<double>& scaled_values, const SessionLatents& with_nuisance) {
    ModelState s;
    s.mechanisms = mechanisms(scaled_values);
    s.actor_range_m = with_nuisance.actor_range_m;
    s.echoes = source_.echoes(s.mechanisms, s.actor_range_m);
    s.nuisance = with_nuisance;
    s.log_likelihood = model_.logLikelihood(s.echoes, with_nuisance, &s.by_pose);
    return s;
  };
  // Latents of all poses or actors may stand in for the cause: it starts without them, too.
  SessionLatents without = nuisance;
  std::fill(without.yaw_rad.begin(), without.yaw_rad.end(), 0.0);
  SessionLatents placed = without;
  std::fill(placed.actor_range_m.begin(), placed.actor_range_m.end(), 0.0);
  SessionLatents bare = placed;
  std::fill(bare.actor_gain.begin(), bare.actor_gain.end(), 0.0);
  std::vector<SessionLatents> candidates = {nuisance};
  if (known == nullptr) {
    candidates.insert(candidates.end(), {without, placed, bare});
    for (const Hypothesis& h : parts) {
      const int actor = source_.base().scene().actorIndex(h.subject);
      if (actor >= 0) candidates.push_back(withoutErrors(nuisance, actor));
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const SessionLatents& a, const SessionLatents& b) { return a.actor_range_m < b.actor_range_m; });
  Optimum o;
  const auto take = [&](const ModelState& s, const std::vector<double>& scaled_values) {
    if (!o.state.echoes.empty() && s.log_likelihood <= o.state.log_likelihood) return;
    o.state = s;
    o.scaled_values = scaled_values;
  };
  const auto consider = [&](const std::vector<double>& scaled_values) {
    ModelState s, best;
    for (const SessionLatents& candidate : candidates) {
      if (s.echoes.empty() || s.actor_range_m != candidate.actor_range_m) {
        s = evaluate(scaled_values, candidate);
      } else {  // equal ranges have the same echoes
        s.nuisance = candidate;
        s.log_likelihood = model_.logLikelihood(s.echoes, candidate, &s.by_pose);
      }
      if (best.echoes.empty() || s.log_likelihood > best.log_likelihood) best = s;
    }
    take(best, scaled_values);
    return best;
  };
  for (const std::vector<double>& start : starts) {
    const ModelState s = consider(start);
    if (null == nullptr || known != nullptr || starts.size() < 2 || !parts.front().isGeometry()) continue;
    // The right start may lose to a smaller one before the latents have settled on it.
    SessionLatents settled = s.nuisance;
    model_.fit(s.echoes, settled, kSettling);
    take(evaluate(start, settled), start);
  }
  // The promise of a quadratic is far off where a level rises from nothing.
  const bool one_sided = parts.size() == 1 && std::any_of(coordinates.begin(), coordinates.end(),
                                                          [](const Coordinate& c) { return c.oneSided(); });
  for (double factor : kOneSidedFactors) {
    if (!one_sided) break;
    std::vector<double> other = starts.front();
    for (double& v : other) v *= factor;
    consider(other);
  }
  const bool geometric = std::any_of(parts.begin(), parts.end(), [&](const Hypothesis& h) {
    return source_.altersGeometry(h.at(std::vector<double>(h.coordinates.size(), 1.0)));
  });
  // A start that is worse than nothing is an error of the quadratic; only geometry has a valley to cross.
  if (!one_sided && !geometric && parts.size() == 1) consider(std::vector<double>(coordinates.size(), 0.0));
  const std::vector<int> everyone = everyPose(o.state);
  const auto derivatives = [&](const ModelState& s, const std::vector<double>& scaled_values) {
    std::vector<SessionCovariance> directions;
    SessionCovariance here;
    for (Eigen::Index j = 0; j < n; ++j) {
      const Coordinate& c = coordinates[static_cast<std::size_t>(j)];
      const double step = c.logarithmic()
                              ? kSmallStep * std::max(1e-4, std::abs(scaled_values[static_cast<std::size_t>(j)]))
                              : kSmallStep;
      const auto covarianceAt = [&](double by) {
        std::vector<double> moved = scaled_values;
        moved[static_cast<std::size_t>(j)] += by;
        return model_.covariance(source_.echoesNear(mechanisms(moved), s.mechanisms, everyone, s.actor_range_m),
                                 s.nuisance, everyone);
      };
      // The likelihood of one strong path is a narrow ridge. A difference to one side would contain the square of a
      // turn or of a gain, which hides the slope and makes the information many times too large.
      if (!c.oneSided()) {
        directions.push_back(difference(covarianceAt(step), covarianceAt(-step), 2 * step));
        continue;
      }
      if (here.empty()) here = model_.covariance(s.echoes, s.nuisance, everyone);
      directions.push_back(difference(covarianceAt(step), here, everyone, step));
    }
    return model_.scores(model_.basis(s.echoes, s.nuisance), directions, everyone);
  };
  double risen = 0;
  for (int i = 0;; ++i) {
    o.scores = derivatives(o.state, o.scaled_values);
    const Eigen::VectorXd step = regularised(o.scores.information).ldlt().solve(o.scores.total);
    const double screened_nats = 0.5 * o.scores.total.dot(step);
    const bool hopeless =
        null != nullptr && i >= 2 &&
        o.state.log_likelihood + kClimb_steps * std::max(risen, screened_nats) < null->log_likelihood + least_nats;
    // On a ridge between a cause and the latents that stood in for it, every step is longer than the one before.
    if (i >= (risen > kRising_nats ? kRisingFactor * steps : steps) || screened_nats < kLeastStep_nats || hopeless)
      break;
    bool better = false;
    for (double share : kStepShares) {
      std::vector<double> next = o.scaled_values;
      for (Eigen::Index j = 0; j < n; ++j) {
        const Coordinate& c = coordinates[static_cast<std::size_t>(j)];
        double& v = next[static_cast<std::size_t>(j)];
        v += share * std::clamp(step[globals + j], -kLongestStep, kLongestStep);
        if (c.logarithmic()) v = std::max(v, 0.3 * o.scaled_values[static_cast<std::size_t>(j)]);
        const double low = std::min(c.scaled(c.min), c.scaled(c.max)),
                     high = std::max(c.scaled(c.min), c.scaled(c.max));
        v = std::clamp(v, low, high);
      }
      ModelState s = evaluate(next, model_.stepped(o.state.nuisance, step.head(globals), o.scores, step, share));
      if (s.log_likelihood <= o.state.log_likelihood) continue;
      risen = s.log_likelihood - o.state.log_likelihood;
      o.state = std::move(s);
      o.scaled_values = next;
      better = true;
      break;
    }
    if (!better) break;
  }
  if (!geometric || n == 0 || n > kMostRough) return o;
  if (null != nullptr && broadGain(*null, o.state) < kWorthASearch_nats) return o;
  if (known != nullptr) {
    const double higher = o.state.log_likelihood - known->state.log_likelihood;
    double apart = 0;
    for (std::size_t j = 0; j < o.scaled_values.size(); ++j) {
      apart = std::max(apart, std::abs(o.scaled_values[j] - known->scaled_values[j]));
    }
    if (higher < -kWorthASearch_nats || (apart < kSearched[1] && higher < kRising_nats)) return o;
  }
  // The likelihood is rough where paths come and go with every millimetre: slopes end at the first bump, a quadratic
  // through values some millimetres apart does not. The latents follow to first order.
  for (double initial : kSearched) {
    const Optimum from = o;
    const Eigen::MatrixXd information = regularised(from.scores.information);
    const Eigen::LDLT<Eigen::MatrixXd> latents(information.topLeftCorner(globals, globals));
    searchQuadratically(coordinates, from.scaled_values, initial, [&](const std::vector<double>& next) {
      Eigen::VectorXd step(globals + n);
      for (Eigen::Index j = 0; j < n; ++j) step[globals + j] = next[j] - from.scaled_values[j];
      step.head(globals) =
          latents.solve(from.scores.total.head(globals) - information.topRightCorner(globals, n) * step.tail(n));
      ModelState s = evaluate(next, model_.stepped(from.state.nuisance, step.head(globals), from.scores, step, 1));
      const double value = s.log_likelihood;
      if (value > o.state.log_likelihood) {
        o.state = std::move(s);
        o.scaled_values = next;
      }
      return value;
    });
    o.scores = derivatives(o.state, o.scaled_values);
    if (o.state.log_likelihood - from.state.log_likelihood < kRising_nats) break;
  }
  return o;
}

std::vector<double> HypothesisFitter::gainByLocation(const ModelState& null, const ModelState& state) const {
  std::vector<double> gain(model_.data().locations.size(), 0.0);
  for (std::size_t i = 0; i < state.by_pose.size(); ++i) {
    gain[static_cast<std::size_t>(model_.data().poses[i].location)] += state.by_pose[i] - null.by_pose[i];
  }
  return gain;
}

double HypothesisFitter::broadGain(const ModelState& null, const ModelState& state) const {
  const double gain = state.log_likelihood - null.log_likelihood;
  const std::vector<double> at = gainByLocation(null, state);
  return at.size() > 1 ? gain - std::max(0.0, *std::max_element(at.begin(), at.end())) : gain;
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
  const double gain = broadGain(state(mechanismsWith(base, parts, scaled_values), &o.state.nuisance), o.state);
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
  std::vector<double> from;
  for (const std::vector<double>& s : start) from.insert(from.end(), s.begin(), s.end());
  Optimum o = maximise(base, nuisance, parts, {from}, kStepsTogether, nullptr, 0, nullptr);
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
  Optimum o = maximise(null.mechanisms, known != nullptr ? known->state.nuisance : null.nuisance, {hypothesis}, starts,
                       kSteps, &null, std::max(kWorthASearch_nats, least_nats), known);
  f.scaled_values = std::move(o.scaled_values);
  f.state = std::move(o.state);
  f.state.echoes = {};  // 80 MB and more a fit, of 154 poses
  const Scores& scores = o.scores;
  gainOver(null, f);
  const std::vector<double> gain_at = gainByLocation(null, f.state);

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
  f.gain_without_best_place = broadGain(null, f.state);
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
