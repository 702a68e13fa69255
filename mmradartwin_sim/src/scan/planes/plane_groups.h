#pragma once

#include <vector>

#include "scan/planes/plane_regions.h"

namespace mmradartwin {

/// Upright or level parts of one plane, wherever they are.
struct PlaneGroup {
  PlaneRegion plane;
  std::vector<int> second_copy;  // samples of what drift has doubled
  bool copies = false;           // the plane is the mean of copies
  Eigen::Vector3d u = Eigen::Vector3d::UnitX(), v = Eigen::Vector3d::UnitY();
  double low_m = 0, high_m = 0;  // of an upright plane: heights of its samples
  bool wall = false;

  Eigen::Vector2d project(const Eigen::Vector3d& p) const { return {u.dot(p), v.dot(p)}; }
};
/// What a room's planes are bounded by. Everything is in map.
struct RoomParts {
  const ScanFrame& frame;
  const ScanSamples& samples;
  double yaw_rad = 0;               ///< of the room's main direction, 0 to 90 deg
  double height_m = 0;              ///< of the walls
  std::vector<PlaneRegion> slants;  ///< bound the room from above
  std::vector<PlaneGroup> groups;

  /// Coordinates along and across the main direction.
  Eigen::Vector2d inMain(const Eigen::Vector3d& p) const;
};

/// Level and upright regions, those of one plane together, and which of them are walls. shifts: of upright planes.
RoomParts roomParts(const ScanFrame& frame, const ScanSamples& samples, const std::vector<PlaneRegion>& regions,
                    double yaw_rad, const std::vector<PlaneShift>& shifts);

bool isLevel(const PlaneRegion& region);
/// A low wall ends where a slanted plane meets it.
bool endsAtSlant(const RoomParts& room, const PlaneGroup& group);
/// Share of a region's area over which a group's plane has samples, too.
double overlap(const ScanSamples& samples, const PlaneGroup& group, const PlaneRegion& region);

}  // namespace mmradartwin
