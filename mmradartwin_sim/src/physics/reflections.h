#pragma once

#include <complex>

#include "physics/elements_in_map.h"

namespace mmradartwin {

/// `weight` times what reflections leave of a closed path of total_m over record.facets, met at `vertices`, in the
/// exp(-jkL) convention: Fresnel coefficients with polarisation between vertical antennas, sqrt(1 - S^2) of each facet
/// and its aperture factor; not the apertures of the two facets of a corner, the first of which is met after `corner`
/// others
/// (-1: there is none). Fills the record's actors and reflection_cosine.
std::complex<double> reflectAlong(const PoseContext& context, const ElementsInMap& elements,
                                  const PerInteraction<Eigen::Vector3d>& vertices, double total_m, int corner,
                                  std::complex<double> weight, PathRecord& record);

}  // namespace mmradartwin
