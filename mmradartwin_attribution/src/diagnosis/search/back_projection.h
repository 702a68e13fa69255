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
  double behind_m = 0;       ///< of a point: how much later than its distance its echo arrives, as one-way range
  double rcs_dbsm = 0;       ///< of a point: its radar cross-section
  std::vector<int> faced{};  ///< poses that a flat side faces, those that gain most first
};

/// Unit vector in map's plane from the radar's mean position to a place.
Eigen::Vector2d awayFromRadar(const ChannelData& data, const Eigen::Vector2d& place);
/// Places on a grid over the scene where one more upright cylinder explains most, over all poses and with nothing
/// refitted. Places lie apart from each other, best first.
std::vector<ProjectedPlace> projectBack(const Twin& twin, const ChannelLikelihood& model, const ModelState& null);
/// Places where a point with a delayed echo explains most, found as by projectBack().
std::vector<ProjectedPlace> projectLateBack(const Twin& twin, const ChannelLikelihood& model, const ModelState& null);
/// Places where a flat side explains most that few poses face and the others do not see; found as by projectBack().
std::vector<ProjectedPlace> projectSidesBack(const Twin& twin, const ChannelLikelihood& model, const ModelState& null);
/// Hypothesis of an object at this place; its size is free.
Hypothesis objectAt(const ProjectedPlace& place);
/// Hypothesis of a late echo of this place and delay; its level is free.
Hypothesis lateEchoAt(const ProjectedPlace& place);
/// Frees further coordinates: the place of objectAt(), with starts there and behind it as seen from the radar; the
/// place and delay of lateEchoAt().
void freePlace(const ChannelData& data, Screened& object);
/// Indices of actors near a place that are small enough to be moved, nearest first.
std::vector<int> objectsNear(const Scene& scene, double x_m, double y_m);

}  // namespace mmradartwin::diagnosis::search
