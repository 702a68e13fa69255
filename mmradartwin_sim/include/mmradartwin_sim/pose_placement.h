#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

// Whether poses and a scene share one map: metres, z up, one origin.

/// The change of scene or poses under which the radar would see the scene from nearly all poses, in words that say what
/// to write where: another unit, y up, another origin. Nothing where none of these does.
std::optional<std::string> placementAdvice(const Scene& scene, const RadarConfig& radar,
                                           const std::vector<Eigen::Isometry3d>& poses);

/// Throws InputError, with placementAdvice(), where scene and poses cannot share one map: a pose stands beyond the
/// radar's reach outside the scene, the scene is a room in millimetres or centimetres, or the twin has no path at any
/// pose. source: file or bag of the poses, for the message. Traces poses until one has a path.
void requirePlaced(const Twin& twin, const std::vector<Pose>& poses, const std::string& source);

/// The twin of a recording, told of its poses (Twin::setSession()), which requirePlaced() holds for. Where the twin
/// cannot be made of a scene that is not placed, the error says the latter.
Twin placedTwin(const TwinDescription& description, const std::vector<Pose>& poses, const std::string& source,
                std::uint64_t seed = 1);

/// placedTwin() for a caller of requirePlaced().
Twin twinAt(const TwinDescription& description, const std::vector<Pose>& poses, const std::string& source,
            std::uint64_t seed = 1);

}  // namespace mmradartwin
