#pragma once

namespace mmradartwin {

/// Fresnel aperture factor of one axis, |E(u2) - E(u1)|/|1 - j| with E = C - jS: 1 for an unbounded plane. u =
/// 2x/sqrt(lambda R) with x from the foot of the perpendicular to the facet's two ends. Regions' own arithmetic:
/// it shares nothing with the simulator's.
double fresnelAperture(double u1, double u2);

}  // namespace mmradartwin
