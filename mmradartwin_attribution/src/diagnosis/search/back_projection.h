#pragma once

#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// Place in the room whose echo the model lacks, with the best of a few sizes or levels.
struct ProjectedPlace {
  double x_m = 0, y_m = 0;   ///< map; of a cylinder, its axis
  double screened_nats = 0;  ///< nats that it explains, without the location that gains most
  double size_m = 0;         ///< diameter of an upright metal cylinder; 0: a point
  double behind_m = 0;       ///< of a point: how much later its echo comes than its distance says, one-way
  double rcs_dbsm = 0;       ///< of a point: its level
};

/// Unit vector in map's plane from where the radar was on average to a place.
Eigen::Vector2d awayFromRadar(const ChannelData& data, const Eigen::Vector2d& place);
/// Places where one more upright cylinder explains most, all poses together and nothing refitted. A grid over the scene
/// is searched; the places lie apart, best first.
std::vector<ProjectedPlace> projectBack(const Twin& twin, const ChannelLikelihood& model, const ModelState& null);
/// Places where a point explains most whose echo comes late by some distance, as projectBack() finds them.
std::vector<ProjectedPlace> projectLateBack(const Twin& twin, const ChannelLikelihood& model, const ModelState& null);
/// Hypothesis of an object at this place; its size is free.
Hypothesis objectAt(const ProjectedPlace& place);
/// Hypothesis of a late echo of this place and distance behind it; its level is free.
Hypothesis lateEchoAt(const ProjectedPlace& place);
/// Frees the place of objectAt() as well, with starts at the place and behind it as seen from the radar; of
/// lateEchoAt() frees place and distance.
void freePlace(const ChannelData& data, Screened& object);
/// Indices of the actors that stand near a place and are small enough to be moved, nearest first.
std::vector<int> objectsNear(const Scene& scene, double x_m, double y_m);

}  // namespace mmradartwin::diagnosis::search
