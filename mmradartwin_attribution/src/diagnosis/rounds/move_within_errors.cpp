#include "diagnosis/rounds/move_within_errors.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/rounds/hypothesis_finding.h"

namespace mmradartwin::diagnosis::rounds {

std::optional<HypothesisFit> moveWithinErrors(DiagnosisContext& context, const ModelState& null,
                                              const HypothesisFit& far) {
  const double most_m = far.stated.leastMove_m();
  if (!far.hypothesis.isMove() || far.moved_m() < most_m) return std::nullopt;
  Hypothesis small = far.hypothesis;
  std::vector<double> start;
  for (std::size_t j = 0; j < small.coordinates.size(); ++j) {
    Coordinate& c = small.coordinates[j];
    if (c.unit == "m") {
      c.min = std::max(c.min, c.neutral - most_m);
      c.max = std::min(c.max, c.neutral + most_m);
    }
    start.push_back(c.scaled(std::clamp(c.value(far.scaled_values[j]), c.min, c.max)));
  }
  context.report("fitting a small move of " + small.subject, 0);
  HypothesisFit fit = context.fitter.fit(null, small, {start});
  context.echoes.setBaseline(null.mechanisms);
  // What is left of a long move must not hide in the range error that the actor has besides.
  const std::size_t actor = static_cast<std::size_t>(context.twin.scene().actorIndex(small.subject));
  const double added_m =
      std::abs(fit.state.latents.actor_range_m[actor]) - std::abs(far.state.latents.actor_range_m[actor]);
  if (added_m > context.accuracy.scene_m) return std::nullopt;
  if (natsApart(far, fit, context.data) > bounds::kNotToldApart_nats) return std::nullopt;
  return fit;
}

}  // namespace mmradartwin::diagnosis::rounds
