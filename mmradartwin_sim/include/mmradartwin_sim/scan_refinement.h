#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_sim/scan_to_scene.h"

namespace mmradartwin {

/// How much farther than its scene an actor's echoes come from.
struct MeasuredRange {
  std::string actor;
  double range_m = 0, std_m = 0;  ///< one way, positive: farther; and its standard deviation
  /// Level, in map, where echoes from several sides tell; and the standard deviations along x and y.
  std::optional<Eigen::Vector2d> shift_m, shift_std_m;
};

/// Reads refinement.yaml of refine_scene (a file, or the folder that holds it). Throws InputError naming file, key and
/// value.
std::vector<MeasuredRange> readRefinement(const std::string& path);

/// What moves walls of a scene, made of a scan, to where a radar within the room has them: along their normals, each
/// plane by the mean over its parts. Throws InputError where none of the actors is a wall or a thing of this scene;
/// `file` names the measurement in it.
std::vector<PlaneShift> shiftsOf(const ScanScene& scene, const std::vector<MeasuredRange>& ranges,
                                 const std::string& file);

/// Moves the things that a measurement displaces; those of which it knows a range alone stay, since one range does not
/// tell where a body went. A sentence for each that moves, and for each that stays since it would stand in a wall.
std::vector<std::string> moveThings(const std::vector<MeasuredRange>& ranges, ScanScene& scene);

/// A sentence for each wall that was moved: its name, where to and how surely.
std::vector<std::string> refinementNotes(const ScanScene& scene, const std::vector<MeasuredRange>& ranges);

}  // namespace mmradartwin
