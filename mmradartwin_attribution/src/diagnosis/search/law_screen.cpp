#include "diagnosis/search/law_screen.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/hypotheses/law_words.h"
#include "diagnosis/likelihood/profiled_scores.h"
#include "diagnosis/search/law_form.h"
#include "diagnosis/search/path_measurement.h"
#include "mmradartwin_sim/law_variable.h"

namespace mmradartwin::diagnosis::search {
namespace {

constexpr double kHuber_sigmas = 2;                         ///< deviation from which a path counts less (Huber)
constexpr int kReweighings = 3;                             ///< iterations of the weights
constexpr double kPlanGrid_m = 0.3, kPlanFineGrid_m = 0.1;  ///< spacing of spots in the floor plan; about the best one
constexpr double kPlanRadii_m[] = {0.4, 0.8, 1.4, 2.4};     ///< radii of spots
constexpr std::size_t kMostSpots = 10000;                   ///< spots of a hall would exceed it
constexpr int kSpotNumbers = 4;                             ///< place (two), radius and level
constexpr int kBearings = 24;                               ///< directions over half a turn
constexpr int kLeastPathsOfActor = 12;                      ///< measured paths of an actor that has laws of its own
/// Residual scatter over the previous one, below which a law is judged by its own scatter.
constexpr double kOwnScatterShare = 0.7;
constexpr double kWeakest_db = -45;             ///< in a law over amplitudes, weaker echoes count as this strong
constexpr double kLawGainPerNumber_nats = 0.5;  ///< expected gain per number by chance
constexpr double kMostLawStart = 8;             ///< limit of a start, scaled

/// Deviations of all paths in one observable, robustly weighted. P: paths, G: latents, K: directions of a law.
struct Sample {
  Observable observable;
  Eigen::VectorXd off;     ///< [P] measured minus expected
  Eigen::VectorXd weight;  ///< [P] 0 where a path does not show the observable
  double scatter = 1;      ///< standard deviation of the residuals
  Eigen::MatrixXd latent;  ///< [P][G] directions of the latents: a constant and the actors' errors
  Eigen::LDLT<Eigen::MatrixXd> latent_solver;
  Eigen::VectorXd latent_prior;  ///< [G] precision
  Eigen::VectorXd latents;       ///< [G] values without a law
  Eigen::VectorXd rest;          ///< [P] residuals without a law

  /// Weighted squares of residuals, with the priors of the latents.
  double squares(const Eigen::VectorXd& left, const Eigen::VectorXd& of_latents) const {
    return left.dot(weight.cwiseProduct(left)) + of_latents.cwiseProduct(latent_prior).dot(of_latents);
  }
};

/// Regression of an observable on the directions of a law.
struct LawRegression {
  double raw = 0;             ///< nats by which the law explains the paths
  double overdispersion = 1;  ///< scatter of the scores over places, divided by that expected by chance
  Eigen::VectorXd value;      ///< [K] in the observable's unit
  double constant = 0;        ///< fitted as well
};

/// Measured paths of a session, and the laws that they support.
class LawScreen {
 public:
  LawScreen(const Twin& base, const ChannelLikelihood& model, const ModelState& null, const std::vector<int>& poses);
  /// Variable of a law, and the actor whose paths it changes.
  struct Over {
    std::string variable, actor = "";  ///< actor empty: all paths
    double bearing_deg = 0;            ///< direction of standing_m
  };
  /// Law of the form that explains most for its numbers.
  std::optional<Screened> best(const Sample& s, const Over& over) const;
  /// [observables]
  const std::vector<Sample>& samples() const { return samples_; }
  const Sample& gain() const { return samples_.front(); }
  /// Gain over the radar's position, along the best direction.
  std::optional<Screened> bestBearing() const;
  /// Gain over the distance to a place that paths pass or where the radar stands, for the best place.
  std::optional<Screened> bestPlace(const std::string& variable) const;
  /// Steps of the gain, at the best times between poses.
  std::optional<Screened> bestSteps() const;
  /// False where gains differ between poses by far more than these steps, or a slope over time, explain.
  bool gainsFollowTime(const std::optional<Screened>& steps) const;
  /// Actors with enough measured paths for a law of their own.
  std::vector<std::string> actorsOftenSeen() const;
  /// [poses that were looked at]
  const std::vector<MeasuredPose>& measured() const { return poses_; }

 private:
  Sample sampleOf(const Observable& observable, std::size_t kind) const;
  /// Regression on directions [P][K], beyond what a constant and the actors' own errors explain.
  LawRegression regress(const Sample& s, const Eigen::MatrixXd& directions) const;
  /// Directions [P][K] of the paths' gains, from numbers [poses][K] of their poses.
  Eigen::MatrixXd directionsOfPoses(const Eigen::MatrixXd& of_poses) const;
  /// [poses][steps] 1 for a pose after a step.
  Eigen::MatrixXd afterSteps(const std::vector<double>& steps_s) const;
  /// Effective number of places that determine a direction, by the shares of their paths.
  double places(const Sample& s, const Eigen::VectorXd& direction) const;
  Hypothesis law(const Observable& o, const Over& over, const std::vector<double>& at) const;

  const Twin& base_;
  const Twin twin_;  ///< with the state's mechanisms; paths refer to its scene
  const ChannelLikelihood& model_;
  std::vector<MeasuredPose> poses_;
  std::vector<int> location_;  ///< [P]
  std::vector<Sample> samples_;
  double whole_ = 1;  ///< poses of the session over measured ones
};

LawScreen::LawScreen(const Twin& base, const ChannelLikelihood& model, const ModelState& null,
                     const std::vector<int>& poses)
    : base_(base), twin_(base.changed(null.mechanisms)), model_(model) {
  const std::vector<Observable> of = observables(base.radar());
  std::int64_t first_ns = model.data().poses.front().pose.stamp_ns;
  for (const PoseChannels& p : model.data().poses) first_ns = std::min(first_ns, p.pose.stamp_ns);
  std::vector<std::optional<MeasuredPose>> each(poses.size());
  tbb::parallel_for(std::size_t{0}, poses.size(), [&](std::size_t j) {
    const std::int64_t stamp_ns = model.data().poses[static_cast<std::size_t>(poses[j])].pose.stamp_ns;
    const double session_s = 1e-9 * static_cast<double>(stamp_ns - first_ns);
    each[j].emplace(measurePaths(twin_, model, null, poses[j], session_s, of));
  });
  double strongest_amplitude = 0;
  for (std::optional<MeasuredPose>& p : each) {
    strongest_amplitude = std::max(strongest_amplitude, p->where.strongest_amplitude);
    location_.insert(location_.end(), p->paths.size(), p->location);
    poses_.push_back(std::move(*p));
  }
  for (MeasuredPose& p : poses_) p.where.strongest_amplitude = strongest_amplitude;
  whole_ = static_cast<double>(null.echoes.size()) / static_cast<double>(poses.size());
  for (std::size_t kind = 0; kind < of.size(); ++kind) samples_.push_back(sampleOf(of[kind], kind));
}

/// Unwraps phases in degrees to within half a turn of their mean direction: a law may lead beyond 180 degrees.
void wrapAround(const Eigen::VectorXd& weight, Eigen::VectorXd& phase_deg) {
  std::complex<double> sum = 0;
  for (Eigen::Index i = 0; i < phase_deg.size(); ++i) sum += std::polar(weight[i], phase_deg[i] * M_PI / 180);
  const double mean_deg = std::arg(sum) * 180 / M_PI;
  for (double& v : phase_deg) v = mean_deg + std::remainder(v - mean_deg, 360);
}

Sample LawScreen::sampleOf(const Observable& observable, std::size_t kind) const {
  using Kind = Observable::Kind;
  const Eigen::Index count = static_cast<Eigen::Index>(location_.size());
  const Eigen::Index actors = static_cast<Eigen::Index>(base_.scene().actors.size());
  const bool of_gain = observable.kind == Kind::kGain, of_actors = of_gain || observable.kind == Kind::kDelay;
  Sample sample;
  sample.observable = observable;
  sample.off.resize(count);
  Eigen::VectorXd shows(count);
  sample.latent = Eigen::MatrixXd::Zero(count, 1 + actors);
  Eigen::Index at = 0;
  for (const MeasuredPose& pose : poses_) {
    for (const MeasuredPath& p : pose.paths) {
      const double share = of_gain ? p.share : 1;
      sample.off[at] = p.off[kind];
      // The heading error of a pose is one number, however many paths the pose has.
      shows[at] = observable.kind == Kind::kAngleOfPose ? 1 / static_cast<double>(pose.paths.size())
                  : of_actors || p.alone                ? 1
                                                        : 0;
      sample.latent(at, 0) = share;
      for (int a : p.record.actors) {
        if (a >= 0 && of_actors) sample.latent(at, 1 + a) += share;
      }
      ++at;
    }
  }
  if (observable.kind == Kind::kChannelPhase) wrapAround(shows, sample.off);
  const double own = of_gain ? 10 / std::log(10.0) * model_.spread().actor_gain : model_.spread().actor_range_m;
  sample.weight = shows;
  if (shows.sum() == 0) return sample;
  const auto median = [&](const Eigen::VectorXd& of) {
    std::vector<double> v;
    for (Eigen::Index i = 0; i < count; ++i) {
      if (shows[i] > 0) v.push_back(of[i]);
    }
    const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    return *middle;
  };
  sample.scatter =
      std::max(observable.floor, 1.4826 * median((sample.off.array() - median(sample.off)).abs().matrix()));
  const auto setBaseline = [&] {
    Eigen::MatrixXd information = sample.latent.transpose() * sample.weight.asDiagonal() * sample.latent;
    information.diagonal() += sample.latent_prior;
    sample.latent_solver.compute(information);
    sample.latents = sample.latent_solver.solve(sample.latent.transpose() * sample.weight.cwiseProduct(sample.off));
    sample.rest = sample.off - sample.latent * sample.latents;
  };
  for (int i = 0; i < kReweighings; ++i) {
    sample.latent_prior = Eigen::VectorXd::Constant(1 + actors, sample.scatter * sample.scatter / (own * own));
    sample.latent_prior[0] = 1e-9;
    setBaseline();
    sample.scatter = std::max(observable.floor, 1.4826 * median(sample.rest.cwiseAbs()));
    sample.weight =
        shows.cwiseProduct((kHuber_sigmas * sample.scatter / sample.rest.array().abs().max(1e-12)).min(1.0).matrix());
  }
  setBaseline();
  return sample;
}

LawRegression LawScreen::regress(const Sample& sample, const Eigen::MatrixXd& directions) const {
  const Eigen::Index n = directions.cols();
  // Latents are eliminated: only the part of a direction that they cannot follow counts.
  const Eigen::MatrixXd weighted = sample.weight.asDiagonal() * directions;
  const Eigen::MatrixXd follow = sample.latent_solver.solve(sample.latent.transpose() * weighted);  // [G][K]
  const Eigen::MatrixXd seen_by_paths =
      directions.transpose() * weighted - (weighted.transpose() * sample.latent) * follow;
  const Eigen::VectorXd total = weighted.transpose() * sample.rest;
  LawRegression regression;
  Eigen::LDLT<Eigen::MatrixXd> solver;
  Eigen::VectorXd latents_after, after;
  double left = 0, scatter = sample.scatter;
  while (true) {
    const double prior = std::pow(scatter / sample.observable.usual, 2);
    Eigen::MatrixXd information = seen_by_paths;
    information.diagonal().array() += prior;
    solver.compute(information);
    regression.value = solver.solve(total);
    latents_after = sample.latents - follow * regression.value;
    after = sample.off - sample.latent * latents_after - directions * regression.value;
    const double squares = sample.squares(after, latents_after);
    left = squares + prior * regression.value.squaredNorm();
    // Residuals of a law of many times the usual size scatter far less than the paths did before.
    const double own = std::max(sample.observable.floor, std::sqrt(squares / std::max(1.0, sample.weight.sum())));
    if (own > kOwnScatterShare * scatter) break;
    scatter = own;
  }
  regression.constant = latents_after[0];
  // The scatter is free as well: nats at its maximum likelihood.
  regression.raw =
      whole_ * 0.5 * sample.weight.sum() * std::log(std::max(1.0, sample.squares(sample.rest, sample.latents) / left));
  const double locations = static_cast<double>(model_.data().locations.size());
  if (locations > 1) {
    const Eigen::MatrixXd seen = directions - sample.latent * follow;
    Eigen::MatrixXd by_location = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(model_.data().locations.size()), n);
    for (Eigen::Index i = 0; i < after.size(); ++i) {
      by_location.row(location_[static_cast<std::size_t>(i)]) += sample.weight[i] * after[i] * seen.row(i);
    }
    const double own = left / std::max(1.0, sample.weight.sum());
    const Eigen::MatrixXd spread = by_location.transpose() * by_location * (locations / (locations - 1) / own);
    regression.overdispersion =
        std::clamp(solver.solve(spread).trace() / static_cast<double>(n), 1.0, kMostOverdispersion);
  }
  return regression;
}

double LawScreen::places(const Sample& s, const Eigen::VectorXd& direction) const {
  Eigen::VectorXd by_location = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model_.data().locations.size()));
  for (Eigen::Index i = 0; i < direction.size(); ++i) {
    by_location[location_[static_cast<std::size_t>(i)]] += s.weight[i] * direction[i] * direction[i];
  }
  return std::pow(by_location.sum(), 2) / std::max(1e-300, by_location.squaredNorm());
}

Hypothesis LawScreen::law(const Observable& observable, const Over& over, const std::vector<double>& at) const {
  Hypothesis hypothesis;
  hypothesis.mechanism = defaultMechanism(mechanismOfForm(MechanismForm::kLaw));
  hypothesis.mechanism.values.set("variable", over.variable);
  hypothesis.mechanism.values.set("at", at);
  hypothesis.mechanism.values.set(observable.parameter, std::vector<double>(at.size(), 0.0));
  hypothesis.mechanism.values.set("actor", over.actor);
  hypothesis.mechanism.values.set("bearing_deg", over.bearing_deg);
  hypothesis.mechanism.values.set("channels", observable.channels);
  hypothesis.subject = std::string(observable.parameter) + " over " + over.variable +
                       (over.actor.empty() ? "" : " of " + over.actor) + channelsInWords(hypothesis.mechanism);
  return hypothesis;
}

/// Coordinates of a form's numbers; o.typical is the typical value.
std::vector<Coordinate> coordinatesOf(const LawForm& form, const Observable& o) {
  std::vector<Coordinate> coordinates;
  for (Eigen::Index k = 0; k < form.shapes.cols(); ++k) {
    Coordinate c{o.parameter, o.unit, -1, 0, o.typical, -o.limit, o.limit};
    const Eigen::VectorXd shape = form.shapes.col(k);
    if (form.of_points) {
      shape.maxCoeff(&c.element);
    } else {
      c.shape.assign(shape.data(), shape.data() + shape.size());
    }
    coordinates.push_back(std::move(c));
  }
  return coordinates;
}

std::optional<Screened> LawScreen::best(const Sample& sample, const Over& over) const {
  const int actor = base_.scene().actorIndex(over.actor);
  const LawVariable of(over.variable, {0, 0, over.bearing_deg, actor});
  const Observable& observable = sample.observable;
  std::vector<LawVariable::Values> values;
  std::vector<double> all;
  for (const MeasuredPose& pose : poses_) {
    for (const MeasuredPath& p : pose.paths) {
      LawVariable::Values v = of.of(pose.where, p.record);
      if (actor >= 0 && std::count(p.record.actors.begin(), p.record.actors.end(), actor) == 0) v.count = 0;
      for (int i = 0; i < v.count; ++i) {
        double& x = v.value[static_cast<std::size_t>(i)];
        if (over.variable == "amplitude_db") x = std::max(x, kWeakest_db);
        all.push_back(x);
      }
      values.push_back(v);
    }
  }
  if (all.empty() || sample.weight.sum() == 0) return std::nullopt;
  const LawForms forms(over.variable, std::move(all), observable.constant);
  if (!forms.varies()) return std::nullopt;
  const Eigen::Index nodes = static_cast<Eigen::Index>(forms.fine().size());
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(values.size()), nodes);
  for (std::size_t p = 0; p < values.size(); ++p) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(nodes);
    for (int i = 0; i < values[p].count; ++i) {
      forms.addAt(values[p].value[static_cast<std::size_t>(i)], 1.0 / values[p].count, row);
    }
    basis.row(static_cast<Eigen::Index>(p)) = sample.latent(static_cast<Eigen::Index>(p), 0) * row;
  }

  std::vector<LawForm> tried = forms.curves();
  if (!observable.isOfChannels()) {
    std::vector<LawForm> others = forms.others();
    std::move(others.begin(), others.end(), std::back_inserter(tried));
  }
  double most = bounds::kLeastNetNatsOfLaw;
  const LawForm* best = nullptr;
  LawRegression of_best;
  for (const LawForm& form : tried) {
    const Eigen::MatrixXd directions = basis * forms.onFine(form);
    if (form.local && places(sample, directions.rightCols(1)) < bounds::kFewestPlacesOfLaw) continue;
    const LawRegression p = regress(sample, directions);
    const double net_nats =
        p.raw / p.overdispersion - bounds::kPriceOfLawNumber_nats * form.priced(observable.constant);
    if (net_nats <= most) continue;
    most = net_nats;
    best = &form;
    of_best = p;
  }
  if (best == nullptr) return std::nullopt;
  Screened result;
  result.hypothesis = law(observable, over, best->at);
  result.hypothesis.variant = best->words;
  result.hypothesis.coordinates = coordinatesOf(*best, observable);
  result.hypothesis.searched = best->searched + 1;  // one more for the variable
  result.screened_nats =
      of_best.raw / of_best.overdispersion - kLawGainPerNumber_nats * best->priced(observable.constant);
  result.starts = {{}};
  for (Eigen::Index k = 0; k < of_best.value.size(); ++k) {
    // All values of a curve contain the constant; in other forms it is the first number.
    const bool has_constant = observable.constant && (k == 0 || best->words.empty());
    const double value = of_best.value[k] + (has_constant ? of_best.constant : 0);
    result.starts.front().push_back(std::clamp(value / observable.typical, -kMostLawStart, kMostLawStart));
  }
  return result;
}

std::vector<std::string> LawScreen::actorsOftenSeen() const {
  std::vector<int> paths(base_.scene().actors.size(), 0);
  for (const MeasuredPose& pose : poses_) {
    for (const MeasuredPath& p : pose.paths) {
      for (int a : std::set<int>(p.record.actors.begin(), p.record.actors.end())) {
        if (a >= 0) ++paths[static_cast<std::size_t>(a)];
      }
    }
  }
  std::vector<std::string> names;
  for (std::size_t a = 0; a < paths.size(); ++a) {
    if (paths[a] >= kLeastPathsOfActor) names.push_back(base_.scene().actors[a].name);
  }
  return names;
}

void keepBetter(std::optional<Screened> s, std::optional<Screened>& best) {
  if (s && (!best || s->screened_nats > best->screened_nats)) best = std::move(s);
}

std::optional<Screened> LawScreen::bestBearing() const {
  std::optional<Screened> best_of_all;
  for (int i = 0; i < kBearings; ++i) {
    keepBetter(best(gain(), {"standing_m", "", 180.0 * i / kBearings}), best_of_all);
  }
  if (best_of_all) {
    ++best_of_all->hypothesis.searched;
    best_of_all->screened_nats -= kLawGainPerNumber_nats;
  }
  return best_of_all;
}

std::optional<Screened> LawScreen::bestPlace(const std::string& variable) const {
  if (location_.empty()) return std::nullopt;
  Eigen::AlignedBox3d bounds;
  for (const Actor& a : base_.scene().actors) bounds.extend(a.bounds);
  const Observable& observable = gain().observable;
  struct Spot {
    double x_m = 0, y_m = 0, radius_m = 0;
    LawRegression regression;
  };
  const auto spotAt = [&](double x_m, double y_m, double radius_m) {
    const LawVariable passing(variable, {x_m, y_m});
    Eigen::MatrixXd direction(static_cast<Eigen::Index>(location_.size()), 1);
    Eigen::Index at = 0;
    for (const MeasuredPose& pose : poses_) {
      for (const MeasuredPath& p : pose.paths) {
        const LawVariable::Values v = passing.of(pose.where, p.record);
        direction(at++, 0) = v.count > 0 ? p.share * std::max(0.0, 1 - v.value[0] / radius_m) : 0;
      }
    }
    return Spot{x_m, y_m, radius_m, regress(gain(), direction)};
  };
  std::vector<Spot> spots;
  for (double x = bounds.min().x() + 0.5 * kPlanGrid_m; x < bounds.max().x(); x += kPlanGrid_m) {
    for (double y = bounds.min().y() + 0.5 * kPlanGrid_m; y < bounds.max().y(); y += kPlanGrid_m) {
      for (double radius : kPlanRadii_m) spots.push_back({x, y, radius, {}});
      if (spots.size() > kMostSpots) return std::nullopt;
    }
  }
  const auto better = [](const Spot& a, const Spot& b) {
    return a.regression.raw / a.regression.overdispersion < b.regression.raw / b.regression.overdispersion;
  };
  const auto bestOf = [&](std::vector<Spot>& all) {
    tbb::parallel_for(std::size_t{0}, all.size(),
                      [&](std::size_t i) { all[i] = spotAt(all[i].x_m, all[i].y_m, all[i].radius_m); });
    return *std::max_element(all.begin(), all.end(), better);
  };
  if (spots.empty()) return std::nullopt;
  const Spot coarse = bestOf(spots);
  std::vector<Spot> near;
  for (int i = -2; i <= 2; ++i) {
    for (int j = -2; j <= 2; ++j) {
      for (double factor : {0.75, 1.0, 1.35}) {
        near.push_back(
            {coarse.x_m + i * kPlanFineGrid_m, coarse.y_m + j * kPlanFineGrid_m, coarse.radius_m * factor, {}});
      }
    }
  }
  const Spot best = bestOf(near);
  const double nats = best.regression.raw / best.regression.overdispersion;
  if (!(nats > bounds::kPriceOfLawNumber_nats * kSpotNumbers)) return std::nullopt;
  Screened result;
  result.hypothesis = law(observable, {variable}, {0, best.radius_m});
  result.hypothesis.mechanism.values.set("x_m", best.x_m);
  result.hypothesis.mechanism.values.set("y_m", best.y_m);
  result.hypothesis.coordinates = {
      {observable.parameter, observable.unit, 0, 0, observable.typical, -observable.limit, observable.limit}};
  result.hypothesis.searched = 4;  // place, radius and the variable
  result.screened_nats = nats - kLawGainPerNumber_nats * kSpotNumbers;
  result.starts = {{std::clamp(best.regression.value[0] / observable.typical, -kMostLawStart, kMostLawStart)}};
  return result;
}

Eigen::MatrixXd LawScreen::directionsOfPoses(const Eigen::MatrixXd& of_poses) const {
  Eigen::MatrixXd of_paths(gain().off.size(), of_poses.cols());
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    for (std::size_t k = 0; k < poses_[i].paths.size(); ++k, ++at) {
      of_paths.row(at) = gain().latent(at, 0) * of_poses.row(static_cast<Eigen::Index>(i));
    }
  }
  return of_paths;
}

Eigen::MatrixXd LawScreen::afterSteps(const std::vector<double>& steps_s) const {
  Eigen::MatrixXd after(static_cast<Eigen::Index>(poses_.size()), static_cast<Eigen::Index>(steps_s.size()));
  for (Eigen::Index i = 0; i < after.rows(); ++i) {
    for (Eigen::Index k = 0; k < after.cols(); ++k) {
      after(i, k) = poses_[static_cast<std::size_t>(i)].where.session_s > steps_s[static_cast<std::size_t>(k)] ? 1 : 0;
    }
  }
  return after;
}

bool LawScreen::gainsFollowTime(const std::optional<Screened>& steps) const {
  const Eigen::Index poses = static_cast<Eigen::Index>(poses_.size());
  if (poses == 0 || gain().weight.sum() == 0) return true;
  Eigen::MatrixXd time(poses, 1);
  for (Eigen::Index i = 0; i < poses; ++i) time(i, 0) = poses_[static_cast<std::size_t>(i)].where.session_s;
  time.array() /= std::max(1.0, time.maxCoeff());
  double by_time = regress(gain(), directionsOfPoses(time)).raw;
  if (steps) {
    const std::vector<double>& steps_s = steps->hypothesis.mechanism.values.numbers("steps_s");
    by_time = std::max(by_time, regress(gain(), directionsOfPoses(afterSteps(steps_s))).raw);
  }
  const double by_pose = regress(gain(), directionsOfPoses(Eigen::MatrixXd::Identity(poses, poses))).raw;
  const double by_chance = kLawGainPerNumber_nats * whole_ * static_cast<double>(poses);
  return by_pose - by_chance < bounds::kBeyondTime * by_time + bounds::kPriceOfLawNumber_nats;
}

std::optional<Screened> LawScreen::bestSteps() const {
  const Sample& sample = gain();
  std::set<double> stamps_s;
  std::set<int> places;
  for (const MeasuredPose& pose : poses_) {
    stamps_s.insert(pose.where.session_s);
    places.insert(pose.location);
  }
  if (stamps_s.size() < 2 || sample.weight.sum() == 0) return std::nullopt;
  std::vector<double> between_s;
  for (auto stamp = std::next(stamps_s.begin()); stamp != stamps_s.end(); ++stamp) {
    between_s.push_back(0.5 * (*std::prev(stamp) + *stamp));
  }
  const auto of = [&](const std::vector<double>& steps_s) {
    return regress(sample, directionsOfPoses(afterSteps(steps_s)));
  };
  // At least two places lie between two steps: a gain of one place may be the place's own.
  const auto isTold = [&](std::vector<double> steps_s) {
    std::sort(steps_s.begin(), steps_s.end());
    std::vector<std::set<int>> between(steps_s.size() + 1);
    for (const MeasuredPose& pose : poses_) {
      const auto after = std::lower_bound(steps_s.begin(), steps_s.end(), pose.where.session_s) - steps_s.begin();
      between[static_cast<std::size_t>(after)].insert(pose.location);
    }
    return std::all_of(between.begin(), between.end(),
                       [&](const std::set<int>& of) { return of.size() >= std::min<std::size_t>(2, places.size()); });
  };
  // Moves one step to the best time, given the others.
  const auto moved = [&](std::vector<double> steps_s, std::size_t which) {
    std::vector<double> best = steps_s;
    double most = -INFINITY;
    for (double t : between_s) {
      if (std::count(steps_s.begin(), steps_s.end(), t) > (steps_s[which] == t ? 1 : 0)) continue;
      steps_s[which] = t;
      if (!isTold(steps_s)) continue;
      const LawRegression p = of(steps_s);
      if (p.raw / p.overdispersion <= most) continue;
      most = p.raw / p.overdispersion;
      best = steps_s;
    }
    return best;
  };
  std::vector<double> steps_s;
  std::optional<Screened> result;
  double most = bounds::kLeastNetNatsOfLaw;
  while (steps_s.size() < std::min<std::size_t>(kMostSteps, between_s.size())) {
    steps_s.push_back(-1);
    steps_s = moved(steps_s, steps_s.size() - 1);
    if (steps_s.back() < 0) break;  // no time is left for one more step
    for (std::size_t which = steps_s.size() - 1; which-- > 0;) steps_s = moved(steps_s, which);
    std::vector<double> sorted_s = steps_s;
    std::sort(sorted_s.begin(), sorted_s.end());
    const LawRegression regression = of(sorted_s);
    const double count = static_cast<double>(steps_s.size()), nats = regression.raw / regression.overdispersion;
    if (nats - bounds::kPriceOfLawNumber_nats * 2 * count <= most) continue;
    most = nats - bounds::kPriceOfLawNumber_nats * 2 * count;
    result.emplace();
    const int steps = static_cast<int>(sorted_s.size());
    Hypothesis& h = result->hypothesis;
    h.mechanism = defaultMechanism(mechanismOfForm(MechanismForm::kGainOverTime));
    h = withSteps(std::move(h), steps).value();
    h.mechanism.values.set("steps_s", sorted_s);
    h.variant += steps > 1 ? " where they show" : " where it shows";
    h.searched = steps;  // the times of the steps
    result->screened_nats = nats - kLawGainPerNumber_nats * 2 * count;
    result->starts = {{}};
    for (double step_db : regression.value)
      result->starts.front().push_back(std::clamp(step_db, -kMostLawStart, kMostLawStart));
  }
  return result;
}

}  // namespace

ScreenedLaws screenLaws(const Twin& base, const ChannelLikelihood& model, const ModelState& null,
                        const std::vector<int>& poses) {
  ScreenedLaws result;
  for (const NamedParameters& m : null.mechanisms) {
    if (traitsOf(m.mechanism).form == MechanismForm::kLaw) return result;  // residuals of one law resemble another
  }
  if (poses.empty()) return result;
  const LawScreen screen(base, model, null, poses);
  const auto add = [&](std::optional<Screened> s) {
    if (s) result.laws.push_back(std::move(*s));
  };
  // An error of directions resembles an error of each channel: the best channel law stands for all.
  std::map<std::string, std::optional<Screened>> of_channels;  // by variable
  for (const Sample& s : screen.samples()) {
    for (const std::string& variable : s.observable.over) {
      std::optional<Screened> law = screen.best(s, {variable});
      if (s.observable.isOfChannels()) {
        keepBetter(std::move(law), of_channels[variable]);
      } else {
        add(std::move(law));
      }
    }
  }
  for (auto& [variable, law] : of_channels) add(std::move(law));
  for (const std::string& actor : screen.actorsOftenSeen()) {
    for (const char* variable : {"foot_m", "time_s"}) add(screen.best(screen.gain(), {variable, actor}));
  }
  const auto drifts = [](const NamedParameters& m) {
    return traitsOf(m.mechanism).form == MechanismForm::kGainOverTime;
  };
  if (std::none_of(null.mechanisms.begin(), null.mechanisms.end(), drifts)) {
    std::optional<Screened> steps = screen.bestSteps();
    result.gains_follow_time = screen.gainsFollowTime(steps);
    if (result.gains_follow_time) add(std::move(steps));
  }
  add(screen.bestBearing());
  for (const std::string& variable : LawVariable::names()) {
    if (LawVariable::isAboutPlace(variable)) add(screen.bestPlace(variable));
  }
  std::stable_sort(result.laws.begin(), result.laws.end(),
                   [](const Screened& a, const Screened& b) { return a.screened_nats > b.screened_nats; });
  result.hiding = hidingPlaces(base.scene(), model, null, poses, screen.measured());
  return result;
}

}  // namespace mmradartwin::diagnosis::search
