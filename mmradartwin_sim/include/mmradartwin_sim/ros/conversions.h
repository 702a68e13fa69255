#pragma once

#include <mmradartwin_msgs/PathRecords.h>
#include <mmradartwin_msgs/Scene.h>

#include <cstdint>
#include <string>

#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// All records of one simulation; frame_id is set by the caller.
mmradartwin_msgs::PathRecords toMsg(const Simulation& simulation, const Scene& scene, std::uint64_t radar_hash);
/// Coloured triangles of the actors and the resolved twin; frame_id is set by the caller.
mmradartwin_msgs::Scene toMsg(const Scene& scene, const std::string& twin_yaml);

}  // namespace mmradartwin
