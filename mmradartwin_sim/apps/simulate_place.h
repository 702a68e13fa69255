#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "mmradartwin_sim/cell_records.h"

namespace mmradartwin {

/// One place of a radar that stands level.
struct PlaceOptions {
  std::string scene_file, radar_file;
  std::string twin_file;  ///< "" = the base mechanisms
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  double yaw_deg = 0;      ///< of the boresight about map z, 0 along x
  std::uint64_t seed = 1;  ///< of the scatter points' phases
  DiffuseRecords diffuse_records = DiffuseRecords::kCells;
};

struct PlaceResult {
  std::size_t paths = 0;
  std::vector<std::string> warnings, notes;  ///< a line each
};

/// Simulates a radar at one place and writes map.png and map.csv (range-angle map), room.png (the scene from above with
/// the strongest paths), paths.csv and place.yaml (what was asked for). Warns where a surface is within 20 cm. Throws
/// InputError for a place inside a body, and where the twin has no path.
PlaceResult simulatePlace(const PlaceOptions& options, const std::string& folder);

}  // namespace mmradartwin
