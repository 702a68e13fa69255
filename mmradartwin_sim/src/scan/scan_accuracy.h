#pragma once

#include "mmradartwin_sim/scan_to_scene.h"

namespace mmradartwin {

/// How far the places and levels of a scene's echoes are known by its scan (docs/room/scan_to_scene.md):
///   scene_m         rms over actors that return echoes of how far each is known along its normals
///   level_db        rms over actors of what their proposed materials may be wrong by, beside that of a known material
///   path_range_m,   of one path: what the planes' bow does to it, at least the shipped values, which have what no
///   path_angle_deg  scan shows
/// The other members keep their shipped values: a scan says nothing of them. Sets range_std_m of the things.
StatedAccuracy accuracyOf(ScanScene& scene);

/// level_db alone, by the materials' standard deviations.
double levelAccuracy_db(const std::vector<MaterialProposal>& materials);

}  // namespace mmradartwin
