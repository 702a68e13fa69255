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

/// What an echo from a perpendicular reflection at a surface leaves of the amplitude; exp(-jkL).
std::complex<double> perpendicularReflection(const Material& material, double frequency_hz);

/// What reflections leave of a wave between vertical antennas that sets out along `out`, is reflected at planes of the
/// given normals in turn and comes back along `arrival` (from the radar, too); exp(-jkL). materials: of the planes.
std::complex<double> reflectionOf(const Eigen::Vector3d& up, const Eigen::Vector3d& out, const Eigen::Vector3d& arrival,
                                  const PerInteraction<Eigen::Vector3d>& normals,
                                  const PerInteraction<const Material*>& materials, double frequency_hz);

/// Gives a record the level of coefficient `now` where it had that of `before`, both exp(-jkL). False where nothing was
/// left of it before, so that its level does not follow.
bool replaceReflection(std::complex<double> before, std::complex<double> now, PathRecord& record);

/// The materials of a record's facets in turn: those of the scene, and those of `before` [actor].
struct MaterialsOfPath {
  PerInteraction<const Material*> before, now;
  bool changed = false;
  MaterialsOfPath(const Scene& scene, const std::vector<Material>& of_actors_before, const PathRecord& record);
};

}  // namespace mmradartwin
