#pragma once

#include <string>
#include <vector>

#include "mmradartwin_sim/scan_to_scene.h"

namespace mmradartwin {

/// How much farther than its scene an actor's echoes come from.
struct MeasuredRange {
  std::string actor;
  double range_m = 0, std_m = 0;  ///< one way, positive: farther; and its standard deviation
};

/// Reads refinement.yaml of refine_scene (a file, or the folder that holds it). Throws InputError naming file, key and
/// value.
std::vector<MeasuredRange> readRefinement(const std::string& path);

/// What moves walls of a scene, made of a scan, to where a radar within the room has them: along their normals, each
/// plane by the mean over its parts. Actors that are no wall stay: one range does not tell where a body went. Throws
/// InputError where none of the actors is a wall of this scene; `file` names the measurement in it.
std::vector<PlaneShift> shiftsOf(const ScanScene& scene, const std::vector<MeasuredRange>& ranges,
                                 const std::string& file);

/// A sentence for each wall that was moved: its name, where to and how surely.
std::vector<std::string> refinementNotes(const ScanScene& scene, const std::vector<MeasuredRange>& ranges);

}  // namespace mmradartwin
