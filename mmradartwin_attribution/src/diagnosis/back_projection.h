#pragma once

#include <optional>

#include "hypothesis.h"
#include "hypothesis_fit.h"

namespace mmradartwin {

/// A place in the room whose echo the model lacks.
struct ProjectedPlace {
  double x_m = 0, y_m = 0;  ///< map
  double promised = 0;      ///< nats by the score test, inflation taken off
  double size_m = 0;        ///< diameter of an upright metal cylinder of that level
};

/// Score test of one more point scatterer at every place of a grid over the scene, all poses together; the best place.
std::optional<ProjectedPlace> projectBack(const Twin& twin, const SessionModel& model, const ModelState& null);
/// The hypothesis of an object there, its start on the coordinates' scale being 0, 0 and 1.
Hypothesis objectAt(const ProjectedPlace& place);

}  // namespace mmradartwin
