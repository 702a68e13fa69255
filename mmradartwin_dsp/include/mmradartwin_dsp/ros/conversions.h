#pragma once

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/Transform.h>
#include <mmradartwin_msgs/AdcCube.h>
#include <mmradartwin_msgs/RadarConfig.h>
#include <mmradartwin_msgs/RangeAngleMap.h>
#include <mmradartwin_msgs/ReceiveGrid.h>
#include <mmradartwin_msgs/Session.h>

#include <cstdint>
#include <vector>

#include "mmradartwin_dsp/adc_cube.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_dsp/session_files.h"

namespace mmradartwin {

ros::Time toRosTime(std::int64_t stamp_ns);
std::int64_t toNanoseconds(const ros::Time& stamp);
/// False for what no clock says and ros::Duration cannot hold: stamps from 2^31 s on, which damaged messages have.
bool usableStamp(const ros::Time& stamp);
geometry_msgs::Pose toMsg(const Eigen::Isometry3d& T);
Eigen::Isometry3d fromMsg(const geometry_msgs::Pose& pose);
/// tf takes quaternions whose length is not quite 1, and tf2::transformToEigen would stretch by them.
Eigen::Isometry3d fromMsg(const geometry_msgs::Transform& transform);

mmradartwin_msgs::RadarConfig toMsg(const RadarConfig& radar);
/// Throws InputError, as a radar.yaml of the same values does that has no max_frame_mb.
RadarConfig fromMsg(const mmradartwin_msgs::RadarConfig& msg);
/// First 8 bytes, little endian, of the SHA-256 of the serialised message with a zeroed header.
std::uint64_t radarHash(const mmradartwin_msgs::RadarConfig& msg);
std::uint64_t radarHash(const RadarConfig& radar);

/// The caller sets header.frame_id; stamp and hash are filled.
mmradartwin_msgs::AdcCube toMsg(const AdcCube& cube, std::uint64_t radar_hash);
AdcCube fromMsg(const mmradartwin_msgs::AdcCube& msg);
mmradartwin_msgs::ReceiveGrid toMsg(const ReceiveGrid& grid, std::uint64_t radar_hash);
ReceiveGrid fromMsg(const mmradartwin_msgs::ReceiveGrid& msg);
mmradartwin_msgs::RangeAngleMap toMsg(const RangeAngleMap& map, std::uint64_t radar_hash);
RangeAngleMap fromMsg(const mmradartwin_msgs::RangeAngleMap& msg);

mmradartwin_msgs::SessionFile toMsg(const StoredFile& file);
/// The files that a session message carries.
std::vector<StoredFile> storedFiles(const mmradartwin_msgs::Session& session);

}  // namespace mmradartwin
