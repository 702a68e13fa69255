#pragma once

#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// A place in the room whose echo the model lacks.
struct ProjectedPlace {
  double x_m = 0, y_m = 0;   ///< map, its axis
  double screened_nats = 0;  ///< nats that it explains, less those of the place that sees it best
  double size_m = 0;         ///< diameter of an upright metal cylinder of that level, of a few; 0: a point,
  double behind_m = 0;       ///< whose echo comes that much later than its distance says,
  double rcs_dbsm = 0;       ///< at a level of a few
};

/// Unit vector in map's plane from where the radar was on average to a place.
Eigen::Vector2d awayFromRadar(const ChannelData& data, const Eigen::Vector2d& place);
/// One more upright cylinder at every place of a grid over the scene, all poses together and nothing refitted; the best
/// places that lie apart, best first.
std::vector<ProjectedPlace> projectBack(const Twin& twin, const ChannelLikelihood& model, const ModelState& null);
/// The same for points whose echo comes late by some distance.
std::vector<ProjectedPlace> projectLateBack(const Twin& twin, const ChannelLikelihood& model, const ModelState& null);
/// The hypothesis of an object at that very place, its size free.
Hypothesis objectAt(const ProjectedPlace& place);
/// The hypothesis of a late echo of that very place and distance behind it, its level free.
Hypothesis lateEchoAt(const ProjectedPlace& place);
/// Lets the place of objectAt() be fitted, too, from where it is and from behind it, as seen from where the radar was;
/// of lateEchoAt() place and distance.
void freePlace(const ChannelData& data, Screened& object);
/// Indices of the actors that can be moved at all, by their size, and stand near a place, the nearest first.
std::vector<int> objectsNear(const Scene& scene, double x_m, double y_m);

}  // namespace mmradartwin::diagnosis::search
