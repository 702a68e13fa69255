#include "hypothesis_fit.h"

#include <nlopt.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>

#include "evidence_bounds.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin {
namespace {

constexpr double kSmallStep = 0.125;           ///< of the scale, for derivatives
constexpr double kSome = 0.3, kLittle = 0.05;  ///< of the scale, where what rises from nothing is looked at first
constexpr double kMore[] = {4, 16};            ///< of the scale, as long as that gains
constexpr double kInstead[] = {0.7, 1, 1.5};   ///< of the scale, where latents have stood in for it
constexpr int kSettling = 3;                   ///< steps of the latents at each of several starts
constexpr double kStoodIn = 1;                 ///< nats of theirs
constexpr double kRadii[] = {1, 2, 4, 7};      ///< of the scale, about a place where an object may have stood before
constexpr int kDirections = 8;
constexpr double kEnough = 0.2;              ///< nats: a further step promises less
constexpr double kRising = 5;                ///< nats of the last step that are worth going on for
constexpr double kClimb = 4;                 ///< steps like the last within which a climb has to get somewhere
constexpr double kWorthASearch = 25;         ///< nats gained by slopes, before a rough likelihood is searched
constexpr double kSearched[] = {0.3, 0.15};  ///< of the scale, around where slopes end
constexpr double kImprovement = 0.5;         ///< nats by which latents have to be better to be taken over
constexpr double kMaxInflation = 50;
// Nats a pose without the best place: seven clean sessions of 66 to 154 poses brought at most 1.9 by any hypothesis. At
// few places the scatter of a rough likelihood's slopes hides gains ten times that.
constexpr double kPlain = 5, kPlainFalseAlarm = 0.01;
constexpr Eigen::Index kMostRough = 4;  ///< coordinates for which values without slopes are worth their number
constexpr double kFoldShares[] = {1, 0.4, 0.1, 0};  // of a fold's step; the fit is its own where nothing is better
constexpr double kPrice = 5;  ///< nats per number, some inflation included: fewer numbers win where all explain alike

// A law bends to all that a name leaves over, too: it takes the name's place where it explains half as much again.
constexpr double kLawShare = 2.0 / 3;
// Scenes are wrong by some 2 cm an actor: a move of less than three times that is no likely cause, and bends to much
// that is another's (the corner with a wall that a cabinet stands too near to).
constexpr double kLeastMove_m = 0.06;

constexpr double kSomewhere = 10;  ///< nats more for an object: it is the best of some 500 places of a room

/// Of a gain that scatters over places more than one by chance would: of G nats, sqrt(2 G).
double inflationOf(double gain, const std::vector<double>& by_location) {
  const double locations = static_cast<double>(by_location.size());
  if (by_location.size() < 2 || !(gain > 0)) return 1;
  const double mean = std::accumulate(by_location.begin(), by_location.end(), 0.0) / locations;
  double squares = 0;
  for (double v : by_location) squares += (v - mean) * (v - mean);
  return std::clamp(squares * locations / (locations - 1) / (2 * gain), 1.0, kMaxInflation);
}

/// The same for what is there or not, whose paths may be seen from few places: those that see none do not gain, and it
/// is those that lose that tell of chance.
double inflationOfPresence(double gain, const std::vector<double>& by_location) {
  if (by_location.size() < 2 || !(gain > 0)) return 1;
  double squares = 0;
  for (double v : by_location) squares += std::min(v, 0.0) * std::min(v, 0.0);
  return std::clamp(squares / gain, 1.0, kMaxInflation);
}

/// An information that can be solved with, also where a direction does nothing.
Eigen::MatrixXd regularised(Eigen::MatrixXd information) {
  information.diagonal().array() += 1e-9 * information.diagonal().array().abs() + 1e-12;
  return information;
}

/// of[i] is of poses[i], from is of all poses.
SessionCovariance difference(SessionCovariance of, const SessionCovariance& from, const std::vector<int>& poses,
                             double per) {
  const float f = static_cast<float>(1 / per);
  for (std::size_t i = 0; i < of.size(); ++i) {
    const PoseCovariance& base = from[static_cast<std::size_t>(poses[i])];
    for (std::size_t j = 0; j < of[i].size(); ++j) of[i][j] = (of[i][j] - base[j]) * f;
  }
  return of;
}

/// The same between two sides; both are of the same poses.
SessionCovariance difference(SessionCovariance of, const SessionCovariance& from, double per) {
  const float f = static_cast<float>(1 / per);
  for (std::size_t i = 0; i < of.size(); ++i) {
    for (std::size_t j = 0; j < of[i].size(); ++j) of[i][j] = (of[i][j] - from[i][j]) * f;
  }
  return of;
}

/// With no error of this actor's own.
Nuisance withoutErrors(Nuisance nuisance, int actor) {
  nuisance.actor_range_m[static_cast<std::size_t>(actor)] = 0;
  nuisance.actor_gain[static_cast<std::size_t>(actor)] = 0;
  return nuisance;
}

/// Without gains of their own of the actors of a material; and nats of what is known of those beforehand.
std::pair<Nuisance, double> withoutGains(Nuisance nuisance, const Scene& scene, const std::string& material,
                                         double spread) {
  double nats = 0;
  for (std::size_t a = 0; a < scene.actors.size(); ++a) {
    if (scene.actors[a].material_tag != material) continue;
    nats += 0.5 * std::pow(nuisance.actor_gain[a] / spread, 2);
    nuisance.actor_gain[a] = 0;
  }
  return {std::move(nuisance), nats};
}

std::vector<int> everyPose(const ModelState& state) {
  std::vector<int> poses(state.echoes.size());
  std::iota(poses.begin(), poses.end(), 0);
  return poses;
}

std::vector<NamedParameters> with(std::vector<NamedParameters> mechanisms, NamedParameters added) {
  mechanisms.push_back(std::move(added));
  return mechanisms;
}

/// Calls `value` at places that lead to its maximum (BOBYQA, Powell 2009: no slopes).
void searchQuadratically(const std::vector<Coordinate>& coordinates, std::vector<double> scaled, double initial_step,
                         const std::function<double(const std::vector<double>&)>& value) {
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
  nlopt_set_xtol_abs1(search.get(), 0.02);
  nlopt_set_maxeval(search.get(), 12 * static_cast<int>(n));
  double best = 0;
  nlopt_optimize(search.get(), scaled.data(), &best);
}

}  // namespace

std::size_t HypothesisFit::numbers() const {
  return std::max<std::size_t>(1, hypothesis.coordinates.size()) + static_cast<std::size_t>(hypothesis.searched);
}

double HypothesisFit::ranking() const {
  const bool named = isCatalogued(hypothesis.mechanism.mechanism);
  double nats = (named ? gain : kLawShare * gain) - kPrice * static_cast<double>(numbers());
  if (hypothesis.mechanism.mechanism == "actor_unmodelled") nats -= kSomewhere;
  if (hypothesis.mechanism.mechanism == "actor_moved" && moved_m() < kLeastMove_m) nats -= kPrice;
  return nats;
}

double HypothesisFit::moved_m() const {
  if (hypothesis.mechanism.mechanism != "actor_moved") return 0;
  const NamedParameters m = hypothesis.at(scaled);
  return std::hypot(m.values.number("dx_m"), m.values.number("dy_m"));
}

double HypothesisFit::size_m() const {
  if (hypothesis.mechanism.mechanism != "actor_unmodelled") return 0;
  return hypothesis.at(scaled).values.number("size_m");
}

void HypothesisFit::loseGain(double nats) {
  gain -= nats;
  broad_gain -= nats;
  held_out_gain -= nats;
}

/// Scores of the hypothesis' own directions with the nuisance's part taken out.
struct HypothesisFitter::Effective {
  Eigen::MatrixXd by_location;  // [L][n]
  Eigen::MatrixXd information;  // [n][n]
  Eigen::MatrixXd scatter;      // [n][n] of the scores' sums, over places and the latents' priors
  Eigen::VectorXd total;
  double inflation = 1;
};

HypothesisFitter::HypothesisFitter(EchoSource& source, const SessionModel& model, int folds)
    : source_(source), model_(model), folds_(folds) {}

HypothesisFitter::Effective HypothesisFitter::effective(const Scores& s, int globals) const {
  Effective e;
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
    // Errors of actors are the same at all places: no scatter over places shows them, their priors do.
    e.scatter += projection.transpose() * s.prior.asDiagonal() * projection;
    const Eigen::MatrixXd ratio = e.information.ldlt().solve(e.scatter);
    e.inflation = std::min(ratio.trace() / static_cast<double>(n), kMaxInflation);
  }
  return e;
}

ModelState HypothesisFitter::state(const std::vector<NamedParameters>& mechanisms, const Nuisance* start) {
  ModelState s;
  s.mechanisms = mechanisms;
  if (start != nullptr) s.actor_range_m = start->actor_range_m;
  s.echoes = source_.echoes(mechanisms, s.actor_range_m);
  s.nuisance = start != nullptr ? *start : model_.start(s.echoes);
  model_.fit(s.echoes, s.nuisance, start != nullptr ? 3 : 14);
  for (int i = 0; i < 2; ++i) {  // ranges that are far off are no matter of first order
    s.actor_range_m = s.nuisance.actor_range_m;
    s.echoes = source_.echoes(mechanisms, s.actor_range_m);
    model_.fit(s.echoes, s.nuisance, 3);
  }
  s.log_likelihood = model_.logLikelihood(s.echoes, s.nuisance, &s.by_pose);
  s.basis = model_.basis(s.echoes, s.nuisance);
  s.covariance = model_.covariance(s.echoes, s.nuisance, everyPose(s));
  return s;
}

std::optional<ModelState> HypothesisFitter::improved(const ModelState& null, const Nuisance& latents) {
  Nuisance other = latents;
  const auto echoes = source_.echoes(null.mechanisms, other.actor_range_m);
  model_.fit(echoes, other, 3);
  if (model_.logLikelihood(echoes, other) < null.log_likelihood + kImprovement) return std::nullopt;
  ModelState s = state(null.mechanisms, &other);
  if (s.log_likelihood < null.log_likelihood + kImprovement) return std::nullopt;
  return s;
}

std::vector<std::pair<int, double>> HypothesisFitter::suspects(const ModelState& null) const {
  std::vector<std::pair<int, double>> result;
  const LatentSpread spread = model_.spread();
  for (std::size_t a = 0; a + 1 < null.nuisance.actor_gain.size(); ++a) {  // the last is of no actor
    const double gain = null.nuisance.actor_gain[a] / spread.actor_gain;
    const double range = null.nuisance.actor_range_m[a] / spread.actor_range_m;
    result.emplace_back(static_cast<int>(a), 0.5 * (gain * gain + range * range));
  }
  std::stable_sort(result.begin(), result.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  return result;
}

std::pair<double, double> HypothesisFitter::valueAt(const ModelState& null, const Hypothesis& hypothesis,
                                                    const std::vector<double>& scaled, const std::vector<int>& poses,
                                                    const Nuisance& nuisance) {
  // About the same ranges as the null's, so that a hypothesis that does nothing gains nothing; but for an actor whose
  // own error was changed.
  std::vector<double> about_m = null.actor_range_m;
  for (std::size_t a = 0; a < about_m.size(); ++a) {
    if (nuisance.actor_range_m[a] != null.nuisance.actor_range_m[a]) about_m[a] = nuisance.actor_range_m[a];
  }
  auto echoes = source_.echoes(with(null.mechanisms, hypothesis.at(scaled)), poses, about_m);
  // Of poses whose echoes stay the value is known.
  std::vector<double> there;
  std::vector<int> changed;
  std::vector<PoseEchoes> changed_echoes;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::size_t pose = static_cast<std::size_t>(poses[i]);
    there.push_back(null.by_pose[pose]);
    if (&nuisance == &null.nuisance && echoes[i].groups == null.echoes[pose].groups) continue;
    changed.push_back(static_cast<int>(i));
    changed_echoes.push_back(std::move(echoes[i]));
  }
  std::vector<int> changed_poses;
  for (int i : changed) changed_poses.push_back(poses[static_cast<std::size_t>(i)]);
  const std::vector<double> values = model_.byPose(changed_echoes, nuisance, changed_poses);
  for (std::size_t i = 0; i < changed.size(); ++i) there[static_cast<std::size_t>(changed[i])] = values[i];
  std::vector<double> by_location(model_.data().locations.size(), 0.0);
  double gain = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::size_t pose = static_cast<std::size_t>(poses[i]);
    const double v = there[i] - null.by_pose[pose];
    gain += v;
    by_location[static_cast<std::size_t>(model_.data().poses[pose].location)] += v;
  }
  const double whole = static_cast<double>(null.echoes.size()) / static_cast<double>(poses.size());
  return {gain,
          whole * gain /
              (hypothesis.isOneSided() ? inflationOfPresence(gain, by_location) : inflationOf(gain, by_location))};
}

Screened HypothesisFitter::screenAround(const ModelState& null, const Hypothesis& hypothesis, int actor,
                                        const std::vector<int>& poses) {
  Screened result{hypothesis, 0, {std::vector<double>(hypothesis.coordinates.size(), 0.0)}};
  const Nuisance nuisance = withoutErrors(null.nuisance, actor);  // they have stood in for the move
  for (double radius : kRadii) {
    for (int k = 0; k < kDirections; ++k) {
      std::vector<double> at(hypothesis.coordinates.size(), 0.0);
      at[0] = radius * std::cos(2 * M_PI * k / kDirections);
      at[1] = radius * std::sin(2 * M_PI * k / kDirections);
      const double promised = valueAt(null, hypothesis, at, poses, nuisance).second;
      source_.settle(null.mechanisms);
      if (promised <= result.promised) continue;
      result.promised = promised;
      result.starts.front() = at;
    }
  }
  return result;
}

Screened HypothesisFitter::screenDirectly(const ModelState& null, const Hypothesis& hypothesis,
                                          const std::vector<int>& poses) {
  std::vector<double> start(hypothesis.coordinates.size(), kLittle);
  double best = 0;
  const auto tryAt = [&](double scaled) {
    const std::vector<double> at(hypothesis.coordinates.size(), scaled);
    const auto [gain, promised] = valueAt(null, hypothesis, at, poses, null.nuisance);
    if (promised > best) {
      best = promised;
      start = at;
    }
    return gain;
  };
  const auto reciprocal = [](const Coordinate& c) { return c.reciprocal(); };
  if (hypothesis.coordinates.empty()) {
    tryAt(1);
  } else if (std::all_of(hypothesis.coordinates.begin(), hypothesis.coordinates.end(), reciprocal)) {
    // A steep edge far above all tones does nothing: it is looked for among them.
    for (double scaled : {0.8, 1.0, 1.3}) tryAt(scaled);
  } else {
    const double gain = tryAt(kSome);
    const bool costly = source_.altersGeometry(hypothesis.at(start));
    if (gain > 0 || !costly) {
      double last = tryAt(gain > 0 ? 1 : kLittle);
      // A level may be far above its typical one, where that one hardly shows.
      const bool level = hypothesis.coordinates.size() == 1 && hypothesis.coordinates[0].logarithmic();
      for (double scaled : kMore) {
        if (!level || gain <= 0 || last <= gain) break;
        const double next = tryAt(scaled);
        if (next <= last) break;
        last = next;
      }
    }
  }
  // What a material does may have been fitted as gains of its actors, beside which it has nothing to do.
  const auto [freed, nats] =
      withoutGains(null.nuisance, source_.base().scene(), hypothesis.subject, model_.spread().actor_gain);
  for (double scaled : kInstead) {
    if (nats < kStoodIn) break;
    const std::vector<double> at(hypothesis.coordinates.size(), scaled);
    const double promised = nats + valueAt(null, hypothesis, at, poses, freed).second;
    if (promised <= best) continue;
    best = promised;
    start = at;
  }
  return {hypothesis, best, {start}};
}

Screened HypothesisFitter::screen(const ModelState& null, const Hypothesis& hypothesis, const std::vector<int>& poses) {
  if (hypothesis.isOneSided()) return screenDirectly(null, hypothesis, poses);
  Screened result{hypothesis, 0, {std::vector<double>(hypothesis.coordinates.size(), 1.0)}};
  std::vector<SessionCovariance> directions;
  for (std::size_t j = 0; j < hypothesis.coordinates.size(); ++j) {
    const std::vector<double> nothing(hypothesis.coordinates.size(), 0.0);
    // What rises from nothing does so with its power: its typical value shows more than the slope at nothing. What
    // shifts or turns does so to first order for small amounts alone.
    const double step = hypothesis.coordinates[j].oneSided() ? 1 : kSmallStep;
    const auto covarianceAt = [&](double scaled) {
      std::vector<double> at = nothing;
      at[j] = scaled;
      const auto echoes =
          step < 1 ? source_.echoesNear(with(null.mechanisms, hypothesis.at(at)),
                                        with(null.mechanisms, hypothesis.at(nothing)), poses, null.actor_range_m)
                   : source_.echoes(with(null.mechanisms, hypothesis.at(at)), poses, null.actor_range_m);
      return model_.covariance(echoes, null.nuisance, poses);
    };
    directions.push_back(hypothesis.coordinates[j].oneSided()
                             ? difference(covarianceAt(step), null.covariance, poses, step)
                             : difference(covarianceAt(step), covarianceAt(-step), 2 * step));
  }
  const Effective e = effective(model_.scores(null.basis, directions, poses), null.nuisance.globals());
  const double whole = static_cast<double>(null.echoes.size()) / static_cast<double>(poses.size());
  Eigen::VectorXd step = e.information.ldlt().solve(e.total);
  bool possible = true;
  for (std::size_t j = 0; j < hypothesis.coordinates.size(); ++j) {
    const bool one_sided = hypothesis.coordinates[j].oneSided();
    if (one_sided && step[static_cast<Eigen::Index>(j)] <= 0) possible = false;
    result.starts.front()[j] = std::clamp(step[static_cast<Eigen::Index>(j)], one_sided ? 0.02 : -8.0, 8.0);
  }
  if (possible) result.promised = whole * 0.5 * e.total.dot(step) / moderated(e.inflation, hypothesis);
  // Slopes are of paths that stay. What a turn of the view lets in and out shows in the likelihood itself.
  if (hypothesis.isGeometry() && hypothesis.coordinates.size() == 1 && source_.altersGeometry(hypothesis.at({1.0}))) {
    for (double scaled : {-1.0, 1.0}) {
      const double promised = valueAt(null, hypothesis, {scaled}, poses, null.nuisance).second;
      if (promised <= result.promised) continue;
      result.promised = promised;
      result.starts.push_back({scaled});
    }
  }
  return result;
}

HypothesisFitter::Optimum HypothesisFitter::maximise(const std::vector<NamedParameters>& base, const Nuisance& nuisance,
                                                     const std::vector<Hypothesis>& parts,
                                                     const std::vector<std::vector<double>>& starts, int iterations,
                                                     const ModelState* null, const HypothesisFit* known) {
  std::vector<Coordinate> coordinates;
  for (const Hypothesis& h : parts) coordinates.insert(coordinates.end(), h.coordinates.begin(), h.coordinates.end());
  const int globals = nuisance.globals();
  const Eigen::Index n = static_cast<Eigen::Index>(coordinates.size());
  const auto mechanisms = [&](const std::vector<double>& at) { return mechanismsWith(base, parts, at); };
  const auto evaluate = [&](const std::vector<double>& scaled, const Nuisance& with_nuisance) {
    ModelState s;
    s.mechanisms = mechanisms(scaled);
    s.actor_range_m = with_nuisance.actor_range_m;
    s.echoes = source_.echoes(s.mechanisms, s.actor_range_m);
    s.nuisance = with_nuisance;
    s.log_likelihood = model_.logLikelihood(s.echoes, with_nuisance, &s.by_pose);
    return s;
  };
  // A cause may have been fitted as the latents of all poses or actors: it starts without them, too.
  Nuisance without = nuisance;
  std::fill(without.yaw_rad.begin(), without.yaw_rad.end(), 0.0);
  Nuisance placed = without;
  std::fill(placed.actor_range_m.begin(), placed.actor_range_m.end(), 0.0);
  Nuisance bare = placed;
  std::fill(bare.actor_gain.begin(), bare.actor_gain.end(), 0.0);
  std::vector<Nuisance> candidates = {nuisance};
  if (known == nullptr) {
    candidates.insert(candidates.end(), {without, placed, bare});
    for (const Hypothesis& h : parts) {
      const int actor = source_.base().scene().actorIndex(h.subject);
      if (actor >= 0) candidates.push_back(withoutErrors(nuisance, actor));
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Nuisance& a, const Nuisance& b) { return a.actor_range_m < b.actor_range_m; });
  Optimum o;
  const auto take = [&](const ModelState& s, const std::vector<double>& scaled) {
    if (!o.state.echoes.empty() && s.log_likelihood <= o.state.log_likelihood) return;
    o.state = s;
    o.scaled = scaled;
  };
  const auto consider = [&](const std::vector<double>& scaled) {
    ModelState s, best;
    for (const Nuisance& candidate : candidates) {
      if (s.echoes.empty() || s.actor_range_m != candidate.actor_range_m) {
        s = evaluate(scaled, candidate);
      } else {  // the same ranges: the same echoes
        s.nuisance = candidate;
        s.log_likelihood = model_.logLikelihood(s.echoes, candidate, &s.by_pose);
      }
      if (best.echoes.empty() || s.log_likelihood > best.log_likelihood) best = s;
    }
    take(best, scaled);
    return best;
  };
  for (const std::vector<double>& start : starts) {
    const ModelState s = consider(start);
    if (null == nullptr || known != nullptr || starts.size() < 2 || !parts.front().isGeometry()) continue;
    // Of several starts the right one may lose to a small one as long as the latents stand as that one needs them.
    Nuisance settled = s.nuisance;
    model_.fit(s.echoes, settled, kSettling);
    take(evaluate(start, settled), start);
  }
  // A quadratic's promise is far off where a level rises from nothing.
  const bool one_sided = parts.size() == 1 && std::any_of(coordinates.begin(), coordinates.end(),
                                                          [](const Coordinate& c) { return c.oneSided(); });
  for (double factor : {0.4, 2.0}) {
    if (!one_sided) break;
    std::vector<double> other = starts.front();
    for (double& v : other) v *= factor;
    consider(other);
  }
  const bool geometric = std::any_of(parts.begin(), parts.end(), [&](const Hypothesis& h) {
    return source_.altersGeometry(h.at(std::vector<double>(h.coordinates.size(), 1.0)));
  });
  // A start that is worse than nothing is a quadratic's error; only geometry has a valley to cross.
  if (!one_sided && !geometric && parts.size() == 1) consider(std::vector<double>(coordinates.size(), 0.0));
  const std::vector<int> everyone = everyPose(o.state);
  const auto derivatives = [&](const ModelState& s, const std::vector<double>& scaled) {
    std::vector<SessionCovariance> directions;
    const SessionCovariance here = model_.covariance(s.echoes, s.nuisance, everyone);
    for (Eigen::Index j = 0; j < n; ++j) {
      const Coordinate& c = coordinates[static_cast<std::size_t>(j)];
      const double step =
          c.logarithmic() ? kSmallStep * std::max(1e-4, std::abs(scaled[static_cast<std::size_t>(j)])) : kSmallStep;
      const auto covarianceAt = [&](double by) {
        std::vector<double> moved = scaled;
        moved[static_cast<std::size_t>(j)] += by;
        return model_.covariance(source_.echoesNear(mechanisms(moved), s.mechanisms, everyone, s.actor_range_m),
                                 s.nuisance, everyone);
      };
      // The channels of one strong path are a narrow ridge: a secant to one side climbs out of it with the square of a
      // turn or of a gain, which hides the slope and makes the information many times too large.
      directions.push_back(c.oneSided() ? difference(covarianceAt(step), here, everyone, step)
                                        : difference(covarianceAt(step), covarianceAt(-step), 2 * step));
    }
    return model_.scores(model_.basis(s.echoes, s.nuisance), directions, everyone);
  };
  double risen = 0;
  for (int i = 0;; ++i) {
    o.scores = derivatives(o.state, o.scaled);
    const Eigen::VectorXd step = regularised(o.scores.information).ldlt().solve(o.scores.total);
    // On a ridge between a cause and the latents that stood in for it, every step widens the next.
    const double promised = 0.5 * o.scores.total.dot(step);
    const bool hopeless =
        null != nullptr && i >= 2 &&
        o.state.log_likelihood + kClimb * std::max(risen, promised) < null->log_likelihood + kWorthASearch;
    if (i >= (risen > kRising ? 4 * iterations : iterations) || promised < kEnough || hopeless) break;
    bool better = false;
    for (double share : {1.0, 0.4, 0.1}) {
      std::vector<double> next = o.scaled;
      for (Eigen::Index j = 0; j < n; ++j) {
        const Coordinate& c = coordinates[static_cast<std::size_t>(j)];
        double& v = next[static_cast<std::size_t>(j)];
        v += share * std::clamp(step[globals + j], -3.0, 3.0);
        if (c.logarithmic()) v = std::max(v, 0.3 * o.scaled[static_cast<std::size_t>(j)]);
        const double low = std::min(c.scaled(c.min), c.scaled(c.max)),
                     high = std::max(c.scaled(c.min), c.scaled(c.max));
        v = std::clamp(v, low, high);
      }
      ModelState s = evaluate(next, model_.stepped(o.state.nuisance, step.head(globals), o.scores, step, share));
      if (s.log_likelihood <= o.state.log_likelihood) continue;
      risen = s.log_likelihood - o.state.log_likelihood;
      o.state = std::move(s);
      o.scaled = next;
      better = true;
      break;
    }
    if (!better) break;
  }
  if (!geometric || n == 0 || n > kMostRough) return o;
  if (null != nullptr && broadGain(*null, o.state) < kWorthASearch) return o;
  if (known != nullptr) {
    const double higher = o.state.log_likelihood - known->state.log_likelihood;
    double apart = 0;
    for (std::size_t j = 0; j < o.scaled.size(); ++j) {
      apart = std::max(apart, std::abs(o.scaled[j] - known->scaled[j]));
    }
    if (higher < -kWorthASearch || (apart < kSearched[1] && higher < kRising)) return o;
  }
  // Where paths come and go with every millimetre the likelihood is rough: slopes end at the first bump, a quadratic
  // through values some millimetres apart does not. The latents follow to first order.
  for (double initial : kSearched) {
    const Optimum from = o;
    const Eigen::MatrixXd information = regularised(from.scores.information);
    const Eigen::LDLT<Eigen::MatrixXd> latents(information.topLeftCorner(globals, globals));
    searchQuadratically(coordinates, from.scaled, initial, [&](const std::vector<double>& next) {
      Eigen::VectorXd step(globals + n);
      for (Eigen::Index j = 0; j < n; ++j) step[globals + j] = next[j] - from.scaled[j];
      step.head(globals) =
          latents.solve(from.scores.total.head(globals) - information.topRightCorner(globals, n) * step.tail(n));
      ModelState s = evaluate(next, model_.stepped(from.state.nuisance, step.head(globals), from.scores, step, 1));
      const double value = s.log_likelihood;
      if (value > o.state.log_likelihood) {
        o.state = std::move(s);
        o.scaled = next;
      }
      return value;
    });
    o.scores = derivatives(o.state, o.scaled);
    if (o.state.log_likelihood - from.state.log_likelihood < kRising) break;
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

Eigen::MatrixXd HypothesisFitter::robustCovariance(const Effective& e) const {
  const double locations = static_cast<double>(e.by_location.rows());
  const Eigen::MatrixXd covariance = e.information.inverse();
  if (locations <= 2) return covariance;
  Eigen::MatrixXd robust = covariance * e.scatter * covariance;
  for (Eigen::Index j = 0; j < robust.rows(); ++j) {  // never below what the likelihood itself says
    const double factor = std::sqrt(std::max(1.0, covariance(j, j) / robust(j, j)));
    robust.row(j) *= factor;
    robust.col(j) *= factor;
  }
  return robust;
}

double HypothesisFitter::worthOfPresence(const std::vector<NamedParameters>& base, const std::vector<Hypothesis>& parts,
                                         const Optimum& o, const Effective& e, Eigen::Index first,
                                         Eigen::Index numbers) {
  std::vector<double> scaled = o.scaled;
  std::fill_n(scaled.begin() + first, numbers, 0.0);
  const double gain = broadGain(state(mechanismsWith(base, parts, scaled), &o.state.nuisance), o.state);
  if (e.scatter.size() == 0) return gain;  // one place: nothing scatters
  return gain / std::clamp(e.scatter(first, first) / e.information(first, first), 1.0, kMaxInflation);
}

double HypothesisFitter::worthOf(const Hypothesis& hypothesis, const Eigen::VectorXd& scaled,
                                 const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& robust) const {
  const double by_likelihood = 0.5 * scaled.dot(covariance.ldlt().solve(scaled));
  const double by_scatter = 0.5 * scaled.dot(robust.ldlt().solve(scaled));
  return by_scatter > 0 ? by_likelihood / moderated(by_likelihood / by_scatter, hypothesis) : 0;
}

JointFit HypothesisFitter::refit(const std::vector<NamedParameters>& base, const Nuisance& nuisance,
                                 const std::vector<Hypothesis>& parts, const std::vector<std::vector<double>>& start) {
  std::vector<double> from;
  for (const std::vector<double>& s : start) from.insert(from.end(), s.begin(), s.end());
  Optimum o = maximise(base, nuisance, parts, {from}, 3, nullptr);
  const Effective e = effective(o.scores, nuisance.globals());
  const Eigen::MatrixXd covariance = e.information.inverse(), robust = robustCovariance(e);
  JointFit fit;
  Eigen::Index at = 0;
  for (const Hypothesis& h : parts) {
    const Eigen::Index n = static_cast<Eigen::Index>(h.coordinates.size());
    const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(o.scaled.data() + at, n);
    fit.scaled.emplace_back(v.data(), v.data() + n);
    std::vector<double> errors;
    for (Eigen::Index j = 0; j < n; ++j) {
      const Coordinate& c = h.coordinates[static_cast<std::size_t>(j)];
      errors.push_back(std::sqrt(robust(at + j, at + j)) * std::abs(c.slope(v[j])));
    }
    fit.standard_error.push_back(std::move(errors));
    fit.worth.push_back(n == 0           ? 0
                        : h.isOneSided() ? worthOfPresence(base, parts, o, e, at, n)
                                         : worthOf(h, v, covariance.block(at, at, n, n), robust.block(at, at, n, n)));
    at += n;
  }
  fit.nuisance = std::move(o.state.nuisance);
  return fit;
}

HypothesisFit HypothesisFitter::fit(const ModelState& null, const Hypothesis& hypothesis,
                                    const std::vector<std::vector<double>>& starts, int iterations,
                                    const HypothesisFit* known) {
  HypothesisFit f;
  f.hypothesis = hypothesis;
  const int globals = null.nuisance.globals();
  const Eigen::Index n = static_cast<Eigen::Index>(hypothesis.coordinates.size());
  Optimum o = maximise(null.mechanisms, known != nullptr ? known->state.nuisance : null.nuisance, {hypothesis}, starts,
                       iterations, &null, known);
  f.scaled = std::move(o.scaled);
  f.state = std::move(o.state);
  const Scores& scores = o.scores;
  f.gain = f.state.log_likelihood - null.log_likelihood;
  f.broad_gain = broadGain(null, f.state);
  const std::vector<double> gain_at = gainByLocation(null, f.state);

  // Scatter over places: of the scores at the fit where there is a number, else of the gain itself.
  const double locations = static_cast<double>(gain_at.size());
  if (n > 0) {
    const Effective e = effective(scores, globals);
    f.inflation = moderated(e.inflation, hypothesis);
    const Eigen::MatrixXd covariance = e.information.inverse(), robust = robustCovariance(e);
    for (Eigen::Index j = 0; j < n; ++j) {
      f.standard_error.push_back(
          std::sqrt(robust(j, j)) *
          std::abs(hypothesis.coordinates[static_cast<std::size_t>(j)].slope(f.scaled[static_cast<std::size_t>(j)])));
    }
    // Without a fold: one step away from the fit by that fold's scores.
    for (int k = 0; k < folds_; ++k) {
      Eigen::VectorXd left_out = Eigen::VectorXd::Zero(n);
      double share = 0;
      for (Eigen::Index l = 0; l < e.by_location.rows(); ++l) {
        if (fold(static_cast<int>(l)) != k) continue;
        left_out += e.by_location.row(l).transpose();
        share += 1 / locations;
      }
      const Eigen::VectorXd shift = covariance * left_out / std::max(0.2, 1 - share);
      std::vector<double> scaled = f.scaled;
      for (Eigen::Index j = 0; j < n; ++j) scaled[static_cast<std::size_t>(j)] -= shift[j];
      f.fold_scaled.push_back(scaled);
      f.held_out_gain -= left_out.dot(shift) + 0.5 * share * shift.dot(e.information * shift);
    }
  } else {
    f.fold_scaled.assign(static_cast<std::size_t>(folds_), {});
    f.inflation = inflationOfPresence(f.gain, gain_at);
  }
  f.held_out_gain += f.gain;
  return f;
}

void HypothesisFitter::settleFolds(const ModelState& null, HypothesisFit& f) {
  if (f.scaled.empty()) return;
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
      for (std::size_t j = 0; j < fold.size(); ++j) fold[j] = f.scaled[j] + share * (whole[j] - f.scaled[j]);
      const auto echoes = source_.echoes(with(null.mechanisms, f.hypothesis.at(fold)), poses, f.state.actor_range_m);
      const std::vector<double> there = model_.byPose(echoes, f.state.nuisance, poses);
      if (std::accumulate(there.begin(), there.end(), 0.0) >= fitted) break;
    }
  }
  source_.settle(null.mechanisms);
}

void HypothesisFitter::judge(HypothesisFit& f, std::size_t family) const {
  f.false_alarm_rate = falseAlarmRate(f.broad_gain / f.inflation, f.hypothesis, f.numbers(), family);
  f.plain = f.broad_gain > kPlain * static_cast<double>(model_.data().poses.size());
  if (f.plain) f.false_alarm_rate = std::min(f.false_alarm_rate, kPlainFalseAlarm);
}

double HypothesisFitter::falseAlarmRate(double gain, const Hypothesis& hypothesis, std::size_t numbers,
                                        std::size_t family) const {
  // Twice the gain against F (Smyth 2004's moderated one): the inflation that it was divided by was estimated from the
  // places, of which the fit has followed as many as it has coordinates, and from what is usual.
  const double n = static_cast<double>(std::max<std::size_t>(1, numbers));
  const double followed = static_cast<double>(hypothesis.coordinates.size());
  const double places = static_cast<double>(model_.data().locations.size()) + usualScatter(hypothesis).places;
  const boost::math::fisher_f distribution(n, std::max(1.0, places - followed));
  const double statistic = 2 * std::max(0.0, gain) / n;
  return std::min(1.0,
                  static_cast<double>(family) * boost::math::cdf(boost::math::complement(distribution, statistic)));
}

double HypothesisFitter::moderated(double inflation, const Hypothesis& hypothesis) const {
  const UsualScatter usual = usualScatter(hypothesis);
  const double places = static_cast<double>(model_.data().locations.size()) - 1;
  if (usual.places + places <= 0) return std::max(1.0, inflation);
  return std::max(1.0, (usual.places * usual.inflation + places * inflation) / (usual.places + places));
}

}  // namespace mmradartwin
