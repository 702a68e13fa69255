#include "diagnosis/search/hypothesis_screen.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "diagnosis/hypotheses/evidence_bounds.h"
#include "diagnosis/likelihood/profiled_scores.h"

namespace mmradartwin::diagnosis::search {
namespace {

// Values are scaled: 0 does nothing, 1 is typical.
constexpr double kNatsAstray = 3;                        ///< nats of an echo whose level is not the expected one
constexpr double kFirstValue = 0.3, kSmallValue = 0.05;  ///< first values of a one-sided hypothesis
constexpr double kFurtherValues[] = {4, 16};             ///< further values, tried as long as they gain
constexpr double kEdges[] = {0.8, 1.0, 1.3};             ///< values that put a steep edge among the tones
/// Values tried where latents may have absorbed a material's effect.
constexpr double kMaterialValues[] = {0.7, 1, 1.5};
constexpr double kLeastAbsorbed_nats = 1;                              ///< least nats of those latents
constexpr double kShifts_m[] = {-0.3, -0.14, -0.06, 0.06, 0.14, 0.3};  ///< shifts of all echoes of an actor, one-way
constexpr double kRadii[] = {1, 2, 4, 7};                 ///< scaled radii about the place where an actor stood
constexpr double kRefinementFactors[] = {0.35, 0.18};     ///< shares of the best place's distance
constexpr int kDirections = 8;                            ///< directions at each radius
constexpr double kTurns_deg[] = {-8, -5, -3, 3, 5, 8};    ///< turns of an actor about itself
constexpr std::size_t kRatioPoses = 12, kRatiosKept = 3;  ///< poses of a scan over ratios, and starts that it gives
constexpr int kRatioSteps = 16;                           ///< values to either side of none
constexpr double kRatioStep = 0.5;                        ///< between them, scaled: 2 cm at 8 m of a room's scale
constexpr std::size_t kLookedAtFirst = 3;                 ///< every third pose is evaluated first
constexpr double kHopeless_nats = 60;                     ///< loss over all poses by which a value is then given up
constexpr std::size_t kStartsKept = 6;                    ///< starts that are kept
constexpr double kMostLossOfStart_nats = 10;              ///< loss up to which a place is judged with refitted latents
constexpr double kMostStart = 8, kLeastOneSidedStart = 0.02;  ///< limits of a start

/// Latents without the gains of a material's actors, and the nats that the prior charged for these gains. spread: prior
/// standard deviation of a gain.
std::pair<SessionLatents, double> withoutGains(SessionLatents latents, const Scene& scene, const std::string& material,
                                               double spread) {
  double nats = 0;
  for (std::size_t a = 0; a < scene.actors.size(); ++a) {
    if (scene.actors[a].material_tag != material) continue;
    nats += 0.5 * std::pow(latents.actor_gain[a] / spread, 2);
    latents.actor_gain[a] = 0;
  }
  return {std::move(latents), nats};
}

}  // namespace

std::vector<std::pair<int, double>> HypothesisScreen::suspects(const ModelState& null) const {
  std::vector<std::pair<int, double>> result;
  const LatentSpread spread = model_.spread();
  Eigen::VectorXd astray = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(null.latents.actor_gain.size()));
  for (const PoseBasis& pose : null.basis.poses) astray += pose.astray;
  for (std::size_t a = 0; a + 1 < null.latents.actor_gain.size(); ++a) {  // the last one belongs to no actor
    const double gain = null.latents.actor_gain[a] / spread.actor_gain;
    const double range = null.latents.actor_range_m[a] / spread.actor_range_m;
    result.emplace_back(static_cast<int>(a), 0.5 * (gain * gain + range * range) +
                                                 kNatsAstray * std::max(0.0, astray[static_cast<Eigen::Index>(a)]));
  }
  std::stable_sort(result.begin(), result.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  return result;
}

std::vector<RangeShift> HypothesisScreen::nearerOrFarther(const ModelState& null, const std::vector<int>& poses) {
  std::vector<RangeShift> result;
  for (std::size_t a = 0; a + 1 < null.latents.actor_range_m.size(); ++a) {  // the last one belongs to no actor
    RangeShift best{static_cast<int>(a), 0, 0};
    SessionLatents latents = withoutErrors(null.latents, static_cast<int>(a));
    std::vector<double> about_m = null.actor_range_m;
    for (double shift_m : kShifts_m) {
      about_m[a] = latents.actor_range_m[a] = shift_m;
      const std::vector<double> there =
          byPose(null, source_.echoes(null.mechanisms, poses, about_m), latents, poses, true);
      double gain = 0;
      for (std::size_t i = 0; i < poses.size(); ++i)
        gain += there[i] - null.by_pose[static_cast<std::size_t>(poses[i])];
      if (gain > best.nats) best = {best.actor, gain, shift_m};
    }
    result.push_back(best);
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const RangeShift& a, const RangeShift& b) { return a.nats > b.nats; });
  return result;
}

std::pair<double, double> HypothesisScreen::valueAt(const ModelState& null, const Hypothesis& hypothesis,
                                                    const std::vector<double>& scaled_values,
                                                    const std::vector<int>& poses, const SessionLatents& latents,
                                                    double beside) {
  std::vector<int> looked_at, rest;
  for (std::size_t i = 0; i < poses.size(); ++i) (i % kLookedAtFirst == 0 ? looked_at : rest).push_back(poses[i]);
  std::vector<double> there = likelihoodsAt(null, hypothesis, scaled_values, looked_at, latents);
  auto [gain, screened_nats] = screenedGain(null, hypothesis, there, looked_at);
  gain *= static_cast<double>(poses.size()) / static_cast<double>(looked_at.size());
  if (gain < beside - kHopeless_nats) return {gain, screened_nats};
  const std::vector<double> more = likelihoodsAt(null, hypothesis, scaled_values, rest, latents);
  there.insert(there.end(), more.begin(), more.end());
  looked_at.insert(looked_at.end(), rest.begin(), rest.end());
  return screenedGain(null, hypothesis, there, looked_at);
}

std::vector<double> HypothesisScreen::likelihoodsAt(const ModelState& null, const Hypothesis& hypothesis,
                                                    const std::vector<double>& scaled_values,
                                                    const std::vector<int>& poses, const SessionLatents& latents) {
  // Echoes are collected about the null's ranges, so that a hypothesis without effect has no gain. An actor whose error
  // was changed has its new range.
  std::vector<double> about_m = null.actor_range_m;
  for (std::size_t a = 0; a < about_m.size(); ++a) {
    if (latents.actor_range_m[a] != null.latents.actor_range_m[a]) about_m[a] = latents.actor_range_m[a];
  }
  std::vector<PoseEchoes> echoes =
      source_.echoes(mechanismsWith(null.mechanisms, {hypothesis}, scaled_values), poses, about_m);
  return byPose(null, std::move(echoes), latents, poses, &latents == &null.latents);
}

std::vector<double> HypothesisScreen::byPose(const ModelState& null, std::vector<PoseEchoes> echoes,
                                             const SessionLatents& latents, const std::vector<int>& poses,
                                             bool known_where_same) const {
  std::vector<double> there;
  std::vector<int> changed;
  std::vector<PoseEchoes> changed_echoes;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::size_t pose = static_cast<std::size_t>(poses[i]);
    there.push_back(null.by_pose[pose]);
    if (known_where_same && echoes[i].groups == null.echoes[pose].groups) continue;
    changed.push_back(static_cast<int>(i));
    changed_echoes.push_back(std::move(echoes[i]));
  }
  std::vector<int> changed_poses;
  for (int i : changed) changed_poses.push_back(poses[static_cast<std::size_t>(i)]);
  const std::vector<double> values = model_.byPose(changed_echoes, latents, changed_poses);
  for (std::size_t i = 0; i < changed.size(); ++i) there[static_cast<std::size_t>(changed[i])] = values[i];
  return there;
}

std::pair<double, double> HypothesisScreen::screenedGain(const ModelState& null, const Hypothesis& hypothesis,
                                                         const std::vector<double>& there,
                                                         const std::vector<int>& poses) const {
  std::vector<double> by_location(model_.data().locations.size(), 0.0);
  double gain = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::size_t pose = static_cast<std::size_t>(poses[i]);
    const double v = there[i] - null.by_pose[pose];
    gain += v;
    by_location[static_cast<std::size_t>(model_.data().poses[pose].location)] += v;
  }
  const double whole = static_cast<double>(null.echoes.size()) / static_cast<double>(poses.size());
  // A geometry acts at all places. A one-sided hypothesis or a move gains at the few places that see it.
  const double overdispersion =
      hypothesis.isGeometry() ? overdispersionOf(gain, by_location) : overdispersionOfPresence(gain, by_location);
  return {gain, whole * gain / overdispersion};
}

Screened HypothesisScreen::around(const ModelState& null, const Hypothesis& hypothesis, int actor,
                                  const std::vector<int>& poses) {
  Screened result{hypothesis, 0, {std::vector<double>(hypothesis.coordinates.size(), 0.0)}};
  const SessionLatents latents = withoutErrors(null.latents, actor);  // the actor's errors have absorbed the move
  double gained = -INFINITY, screened_nats = 0;
  std::vector<double> likeliest(hypothesis.coordinates.size(), 0.0), best_screened;
  const auto tryAt = [&](const std::vector<double>& at) {
    const auto [gain, screened] = valueAt(null, hypothesis, at, poses, latents, std::min(gained, 0.0));
    source_.setBaseline(null.mechanisms);
    if (gain > gained) {
      gained = gain;
      likeliest = at;
    }
    if (screened > screened_nats) {
      screened_nats = screened;
      best_screened = at;
    }
  };
  const auto tryAbout = [&](std::vector<double> middle, double radius) {
    for (int k = 0; k < kDirections; ++k) {
      std::vector<double> at = middle;
      at[0] += radius * std::cos(2 * M_PI * k / kDirections);
      at[1] += radius * std::sin(2 * M_PI * k / kDirections);
      tryAt(at);
    }
  };
  // A wide side that is turned by some degrees echoes to other poses.
  const auto tryTurned = [&](const std::vector<double>& middle, double share) {
    for (std::size_t j = 2; j < hypothesis.coordinates.size(); ++j) {
      for (double turn_deg : kTurns_deg) {
        std::vector<double> at = middle;
        at[j] += hypothesis.coordinates[j].scaled(share * turn_deg);
        tryAt(at);
      }
    }
  };
  const std::vector<double> here(hypothesis.coordinates.size(), 0.0);
  for (double radius : kRadii) tryAbout(here, radius);
  tryTurned(here, 1);
  if (likeliest[0] == 0 && likeliest[1] == 0) {
    const std::vector<double> turned = likeliest;
    for (double radius : kRadii) tryAbout(turned, radius);
  }
  // The likelihood's optimum is some centimetres wide; the places so far lie farther apart.
  for (double share : kRefinementFactors) {
    tryAbout(likeliest, share * std::max(kRadii[0], std::hypot(likeliest[0], likeliest[1])));
    tryTurned(likeliest, share);
  }
  if (gained <= -kMostLossOfStart_nats) likeliest.clear();
  if (best_screened == likeliest) best_screened.clear();
  for (const std::vector<double>& at : {likeliest, best_screened}) {
    if (at.empty()) continue;
    // Latents have adapted to the wrong place with wide errors: they are refitted before a place is judged.
    const double with_latents = screenedWithLatents(null, hypothesis, at, latents);
    source_.setBaseline(null.mechanisms);
    if (with_latents <= result.screened_nats) continue;
    result.screened_nats = with_latents;
    result.starts.front() = at;
  }
  return result;
}

Screened HypothesisScreen::amongStarts(const ModelState& null, Screened of, const std::vector<int>& poses) {
  std::vector<std::pair<double, std::vector<double>>> starts;  // with their screened gains
  for (std::vector<double>& at : of.starts) {
    const double screened_nats = valueAt(null, of.hypothesis, at, poses, null.latents).second;
    starts.emplace_back(screened_nats, std::move(at));
    source_.setBaseline(null.mechanisms);
  }
  std::sort(starts.rbegin(), starts.rend());
  starts.resize(std::min(kStartsKept, starts.size()));
  of.screened_nats = starts.front().first;
  of.starts.clear();
  for (auto& [screened_nats, at] : starts) of.starts.push_back(std::move(at));
  return of;
}

double HypothesisScreen::screenedWithLatents(const ModelState& null, const Hypothesis& hypothesis,
                                             const std::vector<double>& scaled_values, SessionLatents latents) {
  const std::vector<int> all = everyPose(null);
  const auto echoes =
      source_.echoes(mechanismsWith(null.mechanisms, {hypothesis}, scaled_values), all, latents.actor_range_m);
  model_.fit(echoes, latents, kLatentSteps);
  return screenedGain(null, hypothesis, model_.byPose(echoes, latents, all), all).second;
}

Screened HypothesisScreen::directly(const ModelState& null, const Hypothesis& hypothesis,
                                    const std::vector<int>& poses) {
  std::vector<double> start(hypothesis.coordinates.size(), kSmallValue);
  double best = 0;
  const auto tryAt = [&](double scaled_values) {
    const std::vector<double> at(hypothesis.coordinates.size(), scaled_values);
    const auto [gain, screened_nats] = valueAt(null, hypothesis, at, poses, null.latents);
    if (screened_nats > best) {
      best = screened_nats;
      start = at;
    }
    return gain;
  };
  const auto reciprocal = [](const Coordinate& c) { return c.reciprocal(); };
  if (hypothesis.coordinates.empty()) {
    tryAt(1);
  } else if (std::all_of(hypothesis.coordinates.begin(), hypothesis.coordinates.end(), reciprocal)) {
    // A steep edge far above all tones does nothing: values among the tones are tried.
    for (double scaled_values : kEdges) tryAt(scaled_values);
  } else {
    const double gain = tryAt(kFirstValue);
    const bool costly = source_.altersGeometry(hypothesis.at(start));
    if (gain > 0 || !costly) {
      double last = tryAt(gain > 0 ? 1 : kSmallValue);
      // A level may be far above the typical one where that one hardly shows.
      const bool level = hypothesis.coordinates.size() == 1 && hypothesis.coordinates[0].logarithmic();
      for (double scaled_values : kFurtherValues) {
        if (!level || gain <= 0 || last <= gain) break;
        const double next = tryAt(scaled_values);
        if (next <= last) break;
        last = next;
      }
    }
  }
  // Gains of a material's actors may have absorbed the effect of the material: values are tried without them.
  const auto [freed, nats] =
      withoutGains(null.latents, source_.base().scene(), hypothesis.subject, model_.spread().actor_gain);
  for (double scaled_values : kMaterialValues) {
    if (nats < kLeastAbsorbed_nats) break;
    const std::vector<double> at(hypothesis.coordinates.size(), scaled_values);
    const double screened_nats = nats + valueAt(null, hypothesis, at, poses, freed).second;
    if (screened_nats <= best) continue;
    best = screened_nats;
    start = at;
  }
  return {hypothesis, best, {start}};
}

void HypothesisScreen::scanRatio(const ModelState& null, const std::vector<int>& poses, Screened& of) {
  SessionLatents free = null.latents;  // errors of ranges and headings have absorbed a part of it
  std::fill(free.actor_range_m.begin(), free.actor_range_m.end(), 0.0);
  std::fill(free.yaw_rad.begin(), free.yaw_rad.end(), 0.0);
  std::vector<int> few;
  const std::size_t wanted = std::min(kRatioPoses, poses.size());
  for (std::size_t i = 0; i < wanted; ++i) few.push_back(poses[i * poses.size() / wanted]);
  std::vector<std::pair<double, double>> values;  // gain and scaled value
  for (int i = -kRatioSteps; i <= kRatioSteps; ++i) {
    if (i == 0) continue;
    const double at = kRatioStep * i;
    const double beside = values.empty() ? 0 : std::max_element(values.begin(), values.end())->first;
    values.emplace_back(valueAt(null, of.hypothesis, {at}, few, free, beside).first, at);
    source_.setBaseline(null.mechanisms);
  }
  std::sort(values.rbegin(), values.rend());
  for (std::size_t i = 0; i < kRatiosKept; ++i) of.starts.push_back({values[i].second});
}

Screened HypothesisScreen::screen(const ModelState& null, const Hypothesis& hypothesis, const std::vector<int>& poses) {
  if (hypothesis.isOneSided()) return directly(null, hypothesis, poses);
  Screened result{hypothesis, 0, {std::vector<double>(hypothesis.coordinates.size(), 1.0)}};
  std::vector<SessionCovariance> directions;
  for (std::size_t j = 0; j < hypothesis.coordinates.size(); ++j) {
    const std::vector<double> nothing(hypothesis.coordinates.size(), 0.0);
    // A one-sided power shows more at its typical value than by its slope at zero. A shift or a turn acts to first
    // order for small amounts only.
    const double step = hypothesis.coordinates[j].oneSided() ? 1 : kSmallStep;
    const auto covarianceAt = [&](double scaled_values) {
      std::vector<double> at = nothing;
      at[j] = scaled_values;
      const auto echoes =
          step < 1
              ? source_.echoesNear(mechanismsWith(null.mechanisms, {hypothesis}, at),
                                   mechanismsWith(null.mechanisms, {hypothesis}, nothing), poses, null.actor_range_m)
              : source_.echoes(mechanismsWith(null.mechanisms, {hypothesis}, at), poses, null.actor_range_m);
      return model_.covariance(echoes, null.latents, poses);
    };
    directions.push_back(hypothesis.coordinates[j].oneSided()
                             ? difference(covarianceAt(step), null.covariance, poses, step)
                             : difference(covarianceAt(step), covarianceAt(-step), 2 * step));
  }
  const ProfiledScores profiled = profiledScores(model_.scores(null.basis, directions, poses), null.latents.globals());
  const double whole = static_cast<double>(null.echoes.size()) / static_cast<double>(poses.size());
  Eigen::VectorXd step = profiled.information.ldlt().solve(profiled.total);
  bool possible = true;
  for (std::size_t j = 0; j < hypothesis.coordinates.size(); ++j) {
    const bool one_sided = hypothesis.coordinates[j].oneSided();
    if (one_sided && step[static_cast<Eigen::Index>(j)] <= 0) possible = false;
    result.starts.front()[j] =
        std::clamp(step[static_cast<Eigen::Index>(j)], one_sided ? kLeastOneSidedStart : -kMostStart, kMostStart);
  }
  if (possible)
    result.screened_nats = whole * 0.5 * profiled.total.dot(step) /
                           shrunkOverdispersion(profiled.overdispersion, hypothesis, model_.data().locations.size());
  // Slopes hold only paths that stay. Paths that a turn of the view lets in and out show in the likelihood itself.
  if (hypothesis.isGeometry() && hypothesis.coordinates.size() == 1 && source_.altersGeometry(hypothesis.at({1.0}))) {
    for (double scaled_values : {-1.0, 1.0}) {
      const double screened_nats = valueAt(null, hypothesis, {scaled_values}, poses, null.latents).second;
      if (screened_nats <= result.screened_nats) continue;
      result.screened_nats = screened_nats;
      result.starts.push_back({scaled_values});
    }
    if (hypothesis.coordinates[0].unit == "1" && result.screened_nats > 0) scanRatio(null, poses, result);
  }
  return result;
}

}  // namespace mmradartwin::diagnosis::search
