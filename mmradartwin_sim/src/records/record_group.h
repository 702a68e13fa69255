#pragma once

#include <cstddef>
#include <vector>

#include "mmradartwin_sim/path_record.h"

namespace mmradartwin {

/// Records of one event, facet and actor that come back the way they went: scatter points of a surface. Groups of at
/// least `fewest`, in the order of their first records, each as indices.
std::vector<std::vector<std::size_t>> groupByFacet(const std::vector<PathRecord>& records, int fewest);

/// A record with what all records of a group have in common: event, actors, facets, bounces, cosines.
PathRecord standIn(const PathRecord& first);

}  // namespace mmradartwin
