#pragma once

#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_sim/path_record.h"

namespace mmradartwin {

/// How the many records of rough surfaces leave the simulator: summed per cell of their facet, or point by point.
enum class DiffuseRecords { kCells, kPoints };

/// "cells" or "points"; throws InputError naming `key` for anything else.
DiffuseRecords diffuseRecordsFrom(const std::string& text, const std::string& key);

/// Records of the same paths, fewer of them: what comes back from one facet the way it went (scatter points) is summed
/// in cells 4 deg wide as the radar sees them; all other records stay. A cell is a few records at lengths (Chebyshev
/// points of the cell's) from which the tones of all its points follow by interpolation, so that accumulate() gives the
/// same grid within 1e-7 of it, however many points there are. Actor, material, facet and mechanism are those of the
/// points: weights of these act exactly. Direction and vertex are means by power: a weight that changes with direction
/// is taken there. Sum |c|^2 = M A^2 holds, but a cell's amplitude is not common to the channels, and it is that of its
/// points' sum, phases and all. Cells with fewer points than lengths keep their points.
std::vector<PathRecord> sumPerCell(const RadarConfig& radar, std::vector<PathRecord> records);

/// The one or the other.
std::vector<PathRecord> exportedRecords(const RadarConfig& radar, std::vector<PathRecord> records, DiffuseRecords as);

}  // namespace mmradartwin
