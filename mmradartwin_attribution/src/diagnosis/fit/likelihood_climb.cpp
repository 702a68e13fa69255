#include "diagnosis/fit/likelihood_climb.h"

#include <nlopt.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "diagnosis/likelihood/bounded_step.h"
#include "diagnosis/likelihood/profiled_scores.h"

namespace mmradartwin::diagnosis::fit {
namespace {

constexpr int kRisingFactor = 12;        ///< factor on the number of steps while each gains kRising_nats
constexpr double kLeastStep_nats = 0.2;  ///< expected gain of a step below which a climb ends
constexpr double kRising_nats = 0.5;     ///< gain of a step, or promise of the next one, for which a climb goes on
constexpr double kSearched_nats = 5;     ///< gain of a search without slopes for which another one follows
constexpr double kKeptPromise = 0.1;     ///< share of its promise that such a step keeps at least
constexpr double kClimb_steps = 4;       ///< steps as good as the last one within which a climb has to reach least_nats
constexpr double kSearched[] = {0.3, 0.15};        ///< first steps of the search without slopes, scaled
constexpr double kSearchTolerance = 0.02;          ///< tolerance of that search, scaled
constexpr int kSearchPlaces = 12;                  ///< evaluations of that search per coordinate
constexpr double kShareOfPower = 0.125;            ///< step of the derivative by a power, in which all is linear
constexpr double kLongestStep = 3;                 ///< longest step, scaled
constexpr double kLongestShare = 8;                ///< of a step that gains more than it promises
constexpr double kLeastShare = 0.3;                ///< of a logarithmic number that a step leaves
constexpr double kStepShares[] = {1.0, 0.4, 0.1};  ///< shares of a step that are tried until one gains
constexpr double kOneSidedFactors[] = {0.4, 2.0};  ///< factors on a one-sided start
constexpr int kScanned = 12;                       ///< values over the range of a number that is no range
constexpr double kScanned_bins = 0.5;              ///< between scanned values of a range: its modes are a bin wide
constexpr std::size_t kScanPoses = 8;              ///< poses by which scanned values are compared
constexpr std::size_t kMostPeaks = 3;              ///< scanned values that are judged at all poses
constexpr double kFinestScan = 0.05;               ///< accuracy of their places, over the step of the scan
constexpr int kScanSteps = 2, kFirstSteps = 14;    ///< Fisher steps of the latents at such a value, from the data
constexpr double kLeastForScan_nats = 3;           ///< gain over the null below which no other value is looked for
constexpr double kLikelier_nats = 0.5;  ///< gain over the optimum for which a climb starts from a scanned value
constexpr Eigen::Index kMostRough = 4;  ///< largest number of coordinates that are searched without slopes

/// Limits of a coordinate's scaled value, the lower one first.
std::pair<double, double> scaledLimits(const Coordinate& c) { return std::minmax({c.scaled(c.min), c.scaled(c.max)}); }

/// Calls `value` at places that approach its maximum, without slopes (BOBYQA, Powell 2009).
void searchQuadratically(const std::vector<Coordinate>& coordinates, std::vector<double> scaled_values,
                         double initial_step, const std::function<double(const std::vector<double>&)>& value) {
  const unsigned n = static_cast<unsigned>(coordinates.size());
  const std::unique_ptr<std::remove_pointer_t<nlopt_opt>, void (*)(nlopt_opt)> search(nlopt_create(NLOPT_LN_BOBYQA, n),
                                                                                      nlopt_destroy);
  std::vector<double> low, high;
  for (const Coordinate& c : coordinates) {
    const auto [least, most] = scaledLimits(c);
    low.push_back(least);
    high.push_back(most);
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

LikelihoodClimb::LikelihoodClimb(ExpectedEchoes& source, const ChannelLikelihood& model, const ClimbTask& task)
    : source_(source), model_(model), task_(task), globals_(task.latents.globals()) {
  for (const Hypothesis& h : task.parts) {
    coordinates_.insert(coordinates_.end(), h.coordinates.begin(), h.coordinates.end());
  }
  geometric_ = std::any_of(task.parts.begin(), task.parts.end(), [&](const Hypothesis& h) {
    return source_.altersGeometry(h.at(std::vector<double>(h.coordinates.size(), 1.0)));
  });
  latents_ = startingLatents();
}

std::vector<SessionLatents> LikelihoodClimb::startingLatents() const {
  std::vector<SessionLatents> candidates = {task_.latents};
  if (task_.known == nullptr) {
    SessionLatents without_headings = task_.latents;
    std::fill(without_headings.yaw_rad.begin(), without_headings.yaw_rad.end(), 0.0);
    SessionLatents without_ranges = without_headings;
    std::fill(without_ranges.actor_range_m.begin(), without_ranges.actor_range_m.end(), 0.0);
    SessionLatents without_errors = without_ranges;
    std::fill(without_errors.actor_gain.begin(), without_errors.actor_gain.end(), 0.0);
    // The null's own levels of errors have grown by what the cause does.
    SessionLatents usual_levels = task_.latents;
    const SessionLatents usual;
    for (int j = kRelative; j < kShape; ++j) usual_levels.global(j) = usual.global(j);
    candidates.insert(candidates.end(), {without_headings, without_ranges, without_errors, usual_levels});
    for (const Hypothesis& h : task_.parts) {
      const int actor = source_.base().scene().actorIndex(h.subject);
      if (actor >= 0) candidates.push_back(withoutErrors(task_.latents, actor));
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const SessionLatents& a, const SessionLatents& b) { return a.actor_range_m < b.actor_range_m; });
  return candidates;
}

ModelState LikelihoodClimb::stateAt(const std::vector<double>& scaled_values, const SessionLatents& latents) const {
  ModelState s;
  s.mechanisms = mechanismsAt(scaled_values);
  s.actor_range_m = latents.actor_range_m;
  s.echoes = source_.echoes(s.mechanisms, s.actor_range_m);
  s.latents = latents;
  s.log_likelihood = model_.logLikelihood(s.echoes, latents, &s.by_pose);
  return s;
}

void LikelihoodClimb::take(const ModelState& state, const std::vector<double>& scaled_values) {
  if (!optimum_.state.echoes.empty() && state.log_likelihood <= optimum_.state.log_likelihood) return;
  optimum_.state = state;
  optimum_.scaled_values = scaled_values;
}

ModelState LikelihoodClimb::consider(const std::vector<double>& scaled_values) {
  ModelState state, best;
  for (const SessionLatents& candidate : latents_) {
    if (state.echoes.empty() || state.actor_range_m != candidate.actor_range_m) {
      state = stateAt(scaled_values, candidate);
    } else {  // starts with equal ranges share their echoes
      state.latents = candidate;
      state.log_likelihood = model_.logLikelihood(state.echoes, candidate, &state.by_pose);
    }
    if (best.echoes.empty() || state.log_likelihood > best.log_likelihood) best = state;
  }
  take(best, scaled_values);
  return best;
}

void LikelihoodClimb::tryStarts() {
  const std::vector<Hypothesis>& parts = task_.parts;
  for (const std::vector<double>& start : task_.starts) {
    const ModelState s = consider(start);
    if (task_.null == nullptr || task_.known != nullptr || task_.starts.size() < 2 || !parts.front().isGeometry()) {
      continue;
    }
    // The right start may lose to a smaller one until the latents are refitted.
    SessionLatents refitted = s.latents;
    model_.fit(s.echoes, refitted, kLatentSteps);
    take(stateAt(start, refitted), start);
  }
  // A quadratic predicts a one-sided level badly.
  const bool one_sided = parts.size() == 1 && std::any_of(coordinates_.begin(), coordinates_.end(),
                                                          [](const Coordinate& c) { return c.oneSided(); });
  for (double factor : kOneSidedFactors) {
    if (!one_sided) break;
    std::vector<double> other = task_.starts.front();
    for (double& v : other) v *= factor;
    consider(other);
  }
  // A start below the null is an error of the quadratic. Only a geometry may have to cross a valley.
  if (!one_sided && !geometric_ && parts.size() == 1) consider(std::vector<double>(coordinates_.size(), 0.0));
}

Scores LikelihoodClimb::derivatives(const ModelState& state, const std::vector<double>& scaled_values) const {
  std::vector<SessionCovariance> directions;
  SessionCovariance here;
  for (std::size_t j = 0; j < coordinates_.size(); ++j) {
    const Coordinate& coordinate = coordinates_[j];
    const double step =
        coordinate.logarithmic() ? kShareOfPower * std::max(1e-4, std::abs(scaled_values[j])) : kSmallStep;
    const auto covarianceAt = [&](double by) {
      std::vector<double> moved = scaled_values;
      moved[j] += by;
      return model_.covariance(
          source_.echoesNear(mechanismsAt(moved), state.mechanisms, everyone_, state.actor_range_m), state.latents,
          everyone_);
    };
    // The likelihood of one strong path is a narrow ridge. A one-sided difference would contain the square of a turn,
    // of a shift or of a gain, which hides the slope and makes the information many times too large. A power is linear.
    const auto [low, high] = scaledLimits(coordinate);
    const double v = scaled_values[j];
    if (!coordinate.logarithmic() && v - step >= low && v + step <= high) {
      directions.push_back(difference(covarianceAt(step), covarianceAt(-step), 2 * step));
      continue;
    }
    if (here.empty()) here = model_.covariance(state.echoes, state.latents, everyone_);
    const double inward = v + step <= high ? step : -step;
    directions.push_back(difference(covarianceAt(inward), here, everyone_, inward));
  }
  return model_.scores(model_.basis(state.echoes, state.latents), directions, everyone_);
}

BoundedStep LikelihoodClimb::bestStep() const {
  const auto [latents_low, latents_high] = model_.stepBounds(optimum_.state.latents);
  const auto n = static_cast<Eigen::Index>(coordinates_.size());
  Eigen::VectorXd low(globals_ + n), high(globals_ + n);
  low.head(globals_) = latents_low;
  high.head(globals_) = latents_high;
  for (Eigen::Index j = 0; j < n; ++j) {
    const Coordinate& c = coordinates_[static_cast<std::size_t>(j)];
    const double v = optimum_.scaled_values[static_cast<std::size_t>(j)];
    auto [least, most] = scaledLimits(c);
    if (c.logarithmic()) least = std::max(least, kLeastShare * v);
    low[globals_ + j] = std::clamp(least - v, -kLongestStep, 0.0);
    high[globals_ + j] = std::clamp(most - v, 0.0, kLongestStep);
  }
  return boundedStep(regularised(optimum_.scores.information), optimum_.scores.total, low, high);
}

void LikelihoodClimb::climb() {
  double risen = 0, last_promised_nats = 0;
  for (int i = 0;; ++i) {
    optimum_.scores = derivatives(optimum_.state, optimum_.scaled_values);
    const BoundedStep best = bestStep();
    const bool hopeless = task_.null != nullptr && i >= 2 &&
                          optimum_.state.log_likelihood + kClimb_steps * std::max(risen, best.promised_nats) <
                              task_.null->log_likelihood + task_.least_nats;
    // On a ridge between a cause and the latents that absorbed it, each step is longer than the one before, or gains
    // only a share of what its quadratic promises.
    const bool rising =
        risen > kRising_nats || (best.promised_nats > kRising_nats && risen > kKeptPromise * last_promised_nats);
    const int most = rising ? kRisingFactor * task_.steps : task_.steps;
    if (i >= most || best.promised_nats < kLeastStep_nats || hopeless) return;
    const double gained = stepBy(best);
    if (!(gained > 0)) return;
    risen = gained;
    last_promised_nats = best.promised_nats;
  }
}

void LikelihoodClimb::climbOutOfTrap() {
  SessionLatents latents = optimum_.state.latents;
  const double reached = optimum_.state.log_likelihood;
  if (model_.fitWithoutTrap(optimum_.state.echoes, latents, reached) < reached + kLikelier_nats) return;
  take(stateAt(optimum_.scaled_values, latents), optimum_.scaled_values);
  climb();
}

void LikelihoodClimb::takeOverErrors() {
  if (task_.parts.size() != 1 || coordinates_.empty() || task_.parts.front().subject.empty()) return;
  const std::string& subject = task_.parts.front().subject;
  const std::vector<Actor>& actors = source_.base().scene().actors;
  SessionLatents without = optimum_.state.latents;
  bool any = false;
  for (std::size_t i = 0; i < actors.size(); ++i) {
    if (actors[i].name == subject && geometric_) {
      without = withoutErrors(std::move(without), static_cast<int>(i));
    } else if (actors[i].name == subject || actors[i].material.name == subject) {
      without.actor_gain[i] = 0;
    } else {
      continue;
    }
    any = true;
  }
  if (!any) return;
  Eigen::VectorXd apart(globals_);
  for (int j = 0; j < globals_; ++j) apart[j] = without.global(j) - optimum_.state.latents.global(j);
  const auto n = static_cast<Eigen::Index>(coordinates_.size());
  const Eigen::MatrixXd information = regularised(optimum_.scores.information);
  const Eigen::VectorXd step =
      information.bottomRightCorner(n, n).ldlt().solve(-information.bottomLeftCorner(n, globals_) * apart);
  std::vector<double> moved = optimum_.scaled_values;
  for (std::size_t j = 0; j < moved.size(); ++j) {
    const auto [low, high] = scaledLimits(coordinates_[j]);
    moved[j] = std::clamp(moved[j] + step[static_cast<Eigen::Index>(j)], low, high);
  }
  ModelState state = stateAt(moved, without);
  model_.fit(state.echoes, state.latents, kLatentSteps);
  state = stateAt(moved, state.latents);
  if (state.log_likelihood < optimum_.state.log_likelihood + kLikelier_nats) return;
  take(state, moved);
  climb();
}

std::optional<double> LikelihoodClimb::tryStep(const Eigen::VectorXd& step, const Optimum& from, double share) {
  std::vector<double> next = from.scaled_values;
  for (std::size_t j = 0; j < next.size(); ++j) {
    const auto [low, high] = scaledLimits(coordinates_[j]);
    next[j] = std::clamp(next[j] + share * step[globals_ + static_cast<Eigen::Index>(j)], low, high);
  }
  ModelState s = stateAt(next, model_.stepped(from.state.latents, step.head(globals_), from.scores, step, share));
  const double gained = s.log_likelihood - optimum_.state.log_likelihood;
  if (!(gained > 0)) return std::nullopt;
  optimum_.state = std::move(s);
  optimum_.scaled_values = std::move(next);
  return gained;
}

double LikelihoodClimb::stepBy(const BoundedStep& best) {
  const Optimum from = optimum_;
  for (double share : kStepShares) {
    const auto gained = tryStep(best.step, from, share);
    if (!gained) continue;
    // A step that gains more than its quadratic promises is too short.
    double sum = *gained;
    for (double longer = 2 * share; share == 1 && longer <= kLongestShare && sum > best.promised_nats; longer *= 2) {
      const auto more = tryStep(best.step, from, longer);
      if (!more) break;
      sum += *more;
    }
    return sum;
  }
  return 0;
}

bool LikelihoodClimb::spansBins(const Coordinate& c) const {
  return c.unit == "m" && c.max - c.min > kScanned * kScanned_bins * model_.data().radar.range_bin_m();
}

std::vector<double> LikelihoodClimb::scannedValues(const Coordinate& c) const {
  const double step_m = kScanned_bins * model_.data().radar.range_bin_m();
  const int count = spansBins(c) ? static_cast<int>(std::ceil((c.max - c.min) / step_m)) : kScanned;
  std::vector<double> values;
  for (int i = 0; i <= count; ++i) values.push_back(c.scaled(c.min + (c.max - c.min) * i / count));
  return values;
}

std::vector<double> LikelihoodClimb::peaks(const std::vector<double>& values, const SessionLatents& latents) const {
  const std::vector<int> poses = evenlySpread(everyone_.size(), kScanPoses);
  const auto likelihoodAt = [&](double value) {
    const auto echoes = source_.echoes(mechanismsAt({value}), poses, latents.actor_range_m);
    const std::vector<double> each = model_.byPose(echoes, latents, poses);
    return std::accumulate(each.begin(), each.end(), 0.0);
  };
  std::vector<double> likelihoods;
  for (double value : values) likelihoods.push_back(likelihoodAt(value));
  std::vector<std::pair<double, double>> found;  // likelihood and value
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool above_last = i == 0 || likelihoods[i] >= likelihoods[i - 1];
    const bool above_next = i + 1 == values.size() || likelihoods[i] > likelihoods[i + 1];
    if (above_last && above_next) found.emplace_back(likelihoods[i], values[i]);
  }
  std::sort(found.rbegin(), found.rend());
  found.resize(std::min(kMostPeaks, found.size()));
  // With fixed latents: once they follow, they hold a value where it stands.
  const double apart = values.size() > 1 ? values[1] - values[0] : 0;
  std::vector<double> highest;
  for (auto [likelihood, value] : found) {
    for (double step = apart / 2; std::abs(step) > kFinestScan * std::abs(apart); step /= 2) {
      for (const double side : {-step, step}) {
        const double there = likelihoodAt(value + side);
        if (there <= likelihood) continue;
        likelihood = there;
        value += side;
        break;
      }
    }
    highest.push_back(value);
  }
  return highest;
}

void LikelihoodClimb::scan() {
  if (task_.parts.size() != 1 || coordinates_.size() != 1 || geometric_) return;
  const Coordinate& c = coordinates_.front();
  const bool fresh = spansBins(c);
  // Where the start lies in another mode, a range gains nothing at first.
  if (!fresh && task_.null != nullptr &&
      optimum_.state.log_likelihood < task_.null->log_likelihood + kLeastForScan_nats) {
    return;
  }
  const double reached = optimum_.state.log_likelihood;
  // Latents have adapted to the mode of the optimum: where echoes stand beside their bins, the floor has taken them in.
  const SessionLatents from = fresh ? model_.start(optimum_.state.echoes) : optimum_.state.latents;
  for (double value : peaks(scannedValues(c), from)) {
    ModelState state = stateAt({value}, from);
    // Latents stand in for a part of the cause: they follow before values are compared.
    model_.fit(state.echoes, state.latents, fresh ? kFirstSteps : kScanSteps);
    state = stateAt({value}, state.latents);
    if (fresh) {
      climbFrom(std::move(state), {value});
    } else {
      take(state, {value});
    }
  }
  if (!fresh && optimum_.state.log_likelihood > reached + kLikelier_nats) climb();
}

void LikelihoodClimb::climbFrom(ModelState state, std::vector<double> scaled_values) {
  if (task_.null != nullptr && state.log_likelihood < task_.null->log_likelihood + kLeastForScan_nats) return;
  Optimum other = std::move(optimum_);
  optimum_ = Optimum();
  optimum_.state = std::move(state);
  optimum_.scaled_values = std::move(scaled_values);
  climb();
  climbOutOfTrap();
  if (optimum_.state.log_likelihood <= other.state.log_likelihood) optimum_ = std::move(other);
}

bool LikelihoodClimb::needsSearch() const {
  const Eigen::Index n = static_cast<Eigen::Index>(coordinates_.size());
  if (!geometric_ || n == 0 || n > kMostRough) return false;
  if (task_.null != nullptr && gainWithoutBestPlace(model_.data(), *task_.null, optimum_.state) < kLeastForSearch_nats)
    return false;
  if (task_.known == nullptr) return true;
  const double higher = optimum_.state.log_likelihood - task_.known->state.log_likelihood;
  double apart = 0;
  for (std::size_t j = 0; j < optimum_.scaled_values.size(); ++j) {
    apart = std::max(apart, std::abs(optimum_.scaled_values[j] - task_.known->scaled_values[j]));
  }
  return !(higher < -kLeastForSearch_nats || (apart < kSearched[1] && higher < kSearched_nats));
}

void LikelihoodClimb::search(double first_step) {
  const Eigen::Index n = static_cast<Eigen::Index>(coordinates_.size());
  const Optimum from = optimum_;
  const Eigen::MatrixXd information = regularised(from.scores.information);
  const Eigen::LDLT<Eigen::MatrixXd> latents(information.topLeftCorner(globals_, globals_));
  searchQuadratically(coordinates_, from.scaled_values, first_step, [&](const std::vector<double>& next) {
    Eigen::VectorXd step(globals_ + n);
    for (std::size_t j = 0; j < next.size(); ++j) {
      step[globals_ + static_cast<Eigen::Index>(j)] = next[j] - from.scaled_values[j];
    }
    step.head(globals_) =
        latents.solve(from.scores.total.head(globals_) - information.topRightCorner(globals_, n) * step.tail(n));
    ModelState s = stateAt(next, model_.stepped(from.state.latents, step.head(globals_), from.scores, step, 1));
    const double value = s.log_likelihood;
    if (value > optimum_.state.log_likelihood) {
      optimum_.state = std::move(s);
      optimum_.scaled_values = next;
    }
    return value;
  });
  optimum_.scores = derivatives(optimum_.state, optimum_.scaled_values);
}

Optimum LikelihoodClimb::run() {
  tryStarts();
  everyone_ = everyPose(optimum_.state);
  climb();
  scan();
  climbOutOfTrap();
  takeOverErrors();
  if (!needsSearch()) return std::move(optimum_);
  // Where paths appear and vanish with each millimetre, slopes end at the first bump. A quadratic through values some
  // millimetres apart does not. The latents follow to first order.
  for (double first_step : kSearched) {
    const double before = optimum_.state.log_likelihood;
    search(first_step);
    if (optimum_.state.log_likelihood - before < kSearched_nats) break;
  }
  takeOverErrors();
  return std::move(optimum_);
}

std::vector<double> gainByLocation(const ChannelData& data, const ModelState& null, const ModelState& state) {
  std::vector<double> gain(data.locations.size(), 0.0);
  for (std::size_t i = 0; i < state.by_pose.size(); ++i) {
    gain[static_cast<std::size_t>(data.poses[i].location)] += state.by_pose[i] - null.by_pose[i];
  }
  return gain;
}

double gainWithoutBestPlace(const ChannelData& data, const ModelState& null, const ModelState& state) {
  const double gain = state.log_likelihood - null.log_likelihood;
  const std::vector<double> by_location = gainByLocation(data, null, state);
  if (by_location.size() < 2) return gain;
  return gain - std::max(0.0, *std::max_element(by_location.begin(), by_location.end()));
}

}  // namespace mmradartwin::diagnosis::fit
