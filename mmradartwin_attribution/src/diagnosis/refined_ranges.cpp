#include "diagnosis/refined_ranges.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/actor_shifts.h"
#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/likelihood/error_spread.h"

namespace mmradartwin::diagnosis {
namespace {

/// Spread of ranges that stand where the scene has them.
constexpr double kInPlace_m = 1e-5;

PosteriorErrors rangesBy(const DiagnosisContext& context, const ModelState& state, const std::vector<int>& poses) {
  ErrorEvidence evidence = rangeEvidence(context.likelihood, state.basis, poses);
  evidence.leaveOutCommon();
  return posteriorErrors(evidence, context.accuracy.scene_m);
}

/// Where actors are by some poses: their displacements where places determine both components, else their ranges.
struct Places {
  PosteriorErrors ranges;
  PosteriorShifts shifts;
  std::vector<char> shifted;  ///< whose displacement is determined

  /// [errors] added one-way ranges at a pose.
  std::vector<double> rangesAt(int pose, const ActorShifts& evidence) const {
    std::vector<double> range_m = evidence.rangesAt(pose, shifts);
    for (std::size_t e = 0; e < range_m.size(); ++e) {
      if (!shifted[e]) range_m[e] = ranges.mean[e];
    }
    return range_m;
  }
};

Places placesBy(const DiagnosisContext& context, const ModelState& state, const ActorShifts& evidence,
                const std::vector<int>& poses) {
  Places places{rangesBy(context, state, poses), evidence.posterior(poses), {}};
  const double most_m = kSaysSomething * context.accuracy.scene_m;
  for (const ActorShift& shift : places.shifts.actors) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> spectrum(shift.covariance_m2);
    places.shifted.push_back(spectrum.eigenvalues()[1] < most_m * most_m);
  }
  places.shifted.back() = 0;  // what is no actor of the scene
  return places;
}

/// Log-likelihood by pose with actors at these places, which all are farther by a shared range, and all else as it is
/// in a state.
double natsAt(DiagnosisContext& context, const ModelState& state, int pose, std::vector<double> range_m) {
  SessionLatents latents = state.latents;
  latents.actor_range_m = std::move(range_m);
  const std::vector<PoseEchoes> echoes = context.echoes.echoes(state.mechanisms, {pose}, latents.actor_range_m);
  return context.likelihood.byPose(echoes, latents, {pose}).front();
}

/// The same of all poses with the same ranges.
std::vector<double> natsAt(DiagnosisContext& context, const ModelState& state, std::vector<double> range_m) {
  SessionLatents latents = state.latents;
  latents.actor_range_m = std::move(range_m);
  std::vector<double> by_pose;
  const std::vector<PoseEchoes> echoes = context.echoes.echoes(state.mechanisms, latents.actor_range_m);
  context.likelihood.logLikelihood(echoes, latents, &by_pose);
  return by_pose;
}

/// Range that all actors have in a state beyond these: what they share is left out of a refinement, and stays in the
/// likelihood.
double sharedRange_m(const ModelState& state, const PosteriorErrors& ranges) {
  double sum = 0, weights = 0;
  for (std::size_t i = 0; i < ranges.mean.size(); ++i) {
    const double weight = 1 / (ranges.standard_deviation[i] * ranges.standard_deviation[i]);
    sum += weight * (state.latents.actor_range_m[i] - ranges.mean[i]);
    weights += weight;
  }
  return sum / weights;
}

double total(const std::vector<double>& nats) { return std::accumulate(nats.begin(), nats.end(), 0.0); }

/// The state with every actor where the scene has it, all else fitted.
ModelState inPlace(DiagnosisContext& context, const ModelState& state) {
  SessionLatents start = state.latents;
  std::fill(start.actor_range_m.begin(), start.actor_range_m.end(), 0.0);
  const LatentSpread spread = context.likelihood.spread();
  LatentSpread tight = spread;
  tight.actor_range_m = kInPlace_m;
  context.likelihood.setSpread(tight);
  ModelState fitted = context.fitter.state(state.mechanisms, &start);
  context.likelihood.setSpread(spread);
  return fitted;
}

}  // namespace

SceneRefinement refinedRanges(DiagnosisContext& context, const ModelState& state) {
  SceneRefinement refinement;
  refinement.scene_m = context.accuracy.scene_m;
  refinement.poses = static_cast<int>(context.data.poses.size());
  refinement.locations = static_cast<int>(context.data.locations.size());
  context.report("ranges of the actors", 0);
  const ActorShifts evidence(context, state);
  const Places places = placesBy(context, state, evidence, everyPose(state));
  const PosteriorErrors& ranges = places.ranges;
  const std::vector<Actor>& actors = context.twin.scene().actors;
  for (std::size_t i = 0; i < actors.size(); ++i) {
    const std::size_t error = errorOf(static_cast<int>(i), ranges.mean.size());
    if (ranges.standard_deviation[error] > kSaysSomething * refinement.scene_m) continue;
    RefinedActor actor{actors[i].name, ranges.mean[error], ranges.standard_deviation[error], {}};
    if (places.shifted[error]) {
      const ActorShift& shift = places.shifts.actors[error];
      actor.shift = LevelShift{shift.mean_m, shift.covariance_m2};
    }
    refinement.actors.push_back(actor);
  }
  const double shared_m = sharedRange_m(state, ranges);
  const auto beyond = [shared_m](std::vector<double> range_m) {
    for (double& r : range_m) r += shared_m;
    return range_m;
  };
  // All else fitted to actors in their places, or fitted beside their ranges: what is likelier is to be surpassed.
  std::vector<double> before = natsAt(context, state, beyond(std::vector<double>(ranges.mean.size(), 0.0)));
  const ModelState in_place = inPlace(context, state);
  if (total(in_place.by_pose) > total(before)) before = in_place.by_pose;
  std::vector<double> after = before;
  const int folds = std::min(context.fitter.folds(), refinement.locations);
  for (int fold = 0; folds > 1 && fold < folds; ++fold) {
    context.report("gain on held-out places", static_cast<double>(fold) / folds);
    std::vector<int> others;
    for (std::size_t i = 0; i < context.data.poses.size(); ++i) {
      if (context.fitter.fold(context.data.poses[i].location) != fold) others.push_back(static_cast<int>(i));
    }
    const Places by_others = placesBy(context, state, evidence, others);
    for (std::size_t i = 0; i < context.data.poses.size(); ++i) {
      if (context.fitter.fold(context.data.poses[i].location) != fold) continue;
      const int pose = static_cast<int>(i);
      after[i] = natsAt(context, state, pose, beyond(by_others.rangesAt(pose, evidence)));
    }
  }
  refinement.held_out_nats_per_pose = likelihoodGain(context.data, before, after);
  return refinement;
}

}  // namespace mmradartwin::diagnosis
