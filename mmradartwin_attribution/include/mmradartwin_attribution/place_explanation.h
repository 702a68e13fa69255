#pragma once

#include <string>
#include <vector>

#include "mmradartwin_attribution/residual.h"
#include "mmradartwin_attribution/response.h"
#include "mmradartwin_sim/path_record.h"

namespace mmradartwin {

enum class PlaceKind {
  kResidual,       ///< of one of the five classes
  kMatched,        ///< an expected region in which both maps are strong
  kOnlyMeasured,   ///< strong there alone, and no peak of its own
  kOnlySimulated,  ///< the reverse
  kBothStrong,     ///< strong in both, where nothing is expected
  kQuiet           ///< strong in neither
};

/// One path of a place.
struct PathPart {
  int record = 0;          ///< index into the pose's records
  double level_db = 0;     ///< that it alone puts there, relative to the simulated map's peak
  double share = 0;        ///< of the power of the place's paths, without their phases
  double delay_s = 0;      ///< there and back
  double range_m = 0;      ///< half the path's length
  double azimuth_rad = 0;  ///< of arrival as a line array sees it
};

/// What stands behind a place of the map.
struct PlaceExplanation {
  PlaceKind kind = PlaceKind::kQuiet;
  int residual = -1, region = -1;  ///< indices into the pose's; -1: none
  double range_m = 0, azimuth_rad = 0;
  double half_range_m = 0, half_azimuth_rad = 0;  ///< the place reaches so far to either side
  double measured_db = 0, simulated_db = 0;       ///< relative to each map's peak
  std::string actor, material;                    ///< of the region
  std::string sentence, action;
  std::vector<PathPart> paths;  ///< strongest first; their shares are 1 together
};

/// Explains the place that a point of the map means: the nearest box of a residual or of a matched region that it lies
/// in, else the cell. Throws InputError where the point lies outside of the evaluated cells.
PlaceExplanation explainPlace(const EvaluationField& field, const PoseAttribution& pose,
                              const std::vector<PathRecord>& records, double range_m, double azimuth_rad);

/// "C1" to "C5", "matched", "measured", "simulated", "both" or "quiet".
std::string kindName(const PlaceExplanation& place, const PoseAttribution& pose);

}  // namespace mmradartwin
