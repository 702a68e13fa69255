#pragma once

#include <mmradartwin_msgs/PathRecords.h>
#include <mmradartwin_msgs/Scene.h>

#include <cstdint>
#include <string>
#include <vector>

#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// Records of one simulation, as exportedRecords() has them; frame_id is set by the caller.
mmradartwin_msgs::PathRecords toMsg(const Simulation& simulation, const std::vector<PathRecord>& records,
                                    const Scene& scene, std::uint64_t radar_hash);
/// Coloured triangles of the actors and the resolved twin; frame_id is set by the caller.
mmradartwin_msgs::Scene toMsg(const Scene& scene, const std::string& twin_yaml);

}  // namespace mmradartwin
