#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis {

// Poses that were written in another convention than T_map_radar with z up, x forward and the quaternion's w last.

/// One way to read a pose's numbers.
struct PoseReading {
  std::string words;  ///< what the poses are, for the user
  /// T_map_radar by this reading, of what the numbers are by the right convention.
  std::function<Eigen::Isometry3d(const Eigen::Isometry3d&)> T_map_radar;
};
/// Readings by quaternion (w first), direction (inverted), world (y up) and body (optical, camera of OpenGL, y up), and
/// all their combinations; those that change least come first. The right convention is not among them.
const std::vector<PoseReading>& poseReadings();

/// Words for the reading of the poses under which twin and recording clearly belong together by the measure of
/// nothingMatches(), or for two that nothing tells apart. Only readings that leave radars level and near the scene are
/// tried.
std::optional<std::string> matchingPoseReading(const Twin& twin, const ChannelData& data);

}  // namespace mmradartwin::diagnosis
