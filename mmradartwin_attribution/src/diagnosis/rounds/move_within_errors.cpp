#include "diagnosis/rounds/move_within_errors.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/fit/likelihood_climb.h"

namespace mmradartwin::diagnosis::rounds {

std::optional<HypothesisFit> moveWithinErrors(DiagnosisContext& context, const ModelState& null,
                                              const HypothesisFit& far, std::size_t family) {
  const double most_m = far.stated.leastMove_m();
  if (!far.hypothesis.isMove() || far.moved_m() < most_m) return std::nullopt;
  Hypothesis small = far.hypothesis;
  std::vector<double> start, smaller;
  for (std::size_t j = 0; j < small.coordinates.size(); ++j) {
    Coordinate& c = small.coordinates[j];
    const double moved = c.value(far.scaled_values[j]);
    start.push_back(far.scaled_values[j]);
    smaller.push_back(far.scaled_values[j]);
    if (c.unit != "m") continue;
    c.min = std::max(c.min, c.neutral - most_m);
    c.max = std::min(c.max, c.neutral + most_m);
    start.back() = c.scaled(std::clamp(moved, c.min, c.max));
    smaller.back() = start.back() / 3;  // a standard deviation: the most are three
  }
  context.report("fitting a small move of " + small.subject, 0);
  HypothesisFit fit = context.fitter.fit(null, small, {start, smaller});
  context.echoes.setBaseline(null.mechanisms);
  // What is left of a long move must not hide in the range error that the actor has besides.
  const std::size_t actor = static_cast<std::size_t>(context.twin.scene().actorIndex(small.subject));
  const double added_m =
      std::abs(fit.state.latents.actor_range_m[actor]) - std::abs(far.state.latents.actor_range_m[actor]);
  if (added_m > context.accuracy.scene_m) return std::nullopt;
  HypothesisFit beyond = far;
  beyond.gain_without_best_place = gainWithoutBestPlace(context.data, fit.state, far.state);
  context.fitter.judge(beyond, family);
  return beyond.false_alarm_rate > bounds::kFalseAlarmRateOfRound ? std::optional(std::move(fit)) : std::nullopt;
}

}  // namespace mmradartwin::diagnosis::rounds
