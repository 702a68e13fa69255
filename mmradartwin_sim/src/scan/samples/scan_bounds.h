#pragma once

#include <cmath>

/// What rooms, people's scans and the radar are like, as far as steps from scan to scene lean on it. Each bound has its
/// meaning, its unit and what it rests on: physics, building practice, what scanners do, or an effort. What differs
/// from scan to scan is no bound: noise, tolerance (planeTolerance) and spacing are measured. Signs of single classes
/// of furniture stand in thing_class.cpp, limits of files in scan_reader.cpp, steps of numerics where they are used.
namespace mmradartwin::bounds {

inline constexpr double kDegree = M_PI / 180;

// ---- samples

/// Side of a voxel. Physics: an echo is formed by a patch of sqrt(wavelength * range / 2), 8 cm at 3 m, which has some
/// forty samples by that.
inline constexpr double kFinest_m = 0.02;
/// Side of the cells in which footprints, openings and scanned surface are counted: two and a half voxels, so that a
/// cell of a scanned surface holds a sample wherever the voxels lie.
inline constexpr double kCell_m = 2.5 * kFinest_m;
/// Reach of the neighbours whose plane gives a sample its normal, voxels. Effort: some forty neighbours.
inline constexpr double kReachOfNormals_voxels = 3.5;
/// Over so much of a surface the slow errors of a scanner (drift, depth distortion) are alike. Scanners: a depth
/// camera's field at arm's length, the step between two registered frames.
inline constexpr double kDriftPatch_m = 0.5;

// ---- planes

/// Smallest flat part: 0.2 m square, which is as wide as the radar's patch at 5 m.
inline constexpr double kLeastPlane_m2 = 0.04;
/// Turn between parts of one plane. Scanners: drift turns a wall by a degree or two from end to end, and a small part's
/// own normal is known no better.
inline constexpr double kSameTurn_deg = 4;
/// |cosine| between the normal of noisy samples and up, below which a surface is upright: within 17 deg.
inline constexpr float kUprightNormal = 0.3F;
/// |cosine| between a plane's normal and up, below which a flat part is upright: within 6 deg.
inline constexpr double kUprightPlane = 0.1;
/// |cosine| between a plane's normal and up, above which a flat part is level: within 18 deg.
inline constexpr double kLevelPlane = 0.95;
/// Cosine between the normals of parallel walls: within 11 deg. Building practice: what is skewed on purpose is more.
inline constexpr double kParallel = 0.98;
/// Angle between up and the normals of level planes, once up is known.
inline constexpr double kLevel_deg = 3;
/// Angle between up and the normals of planes that count as level or upright, before up is known: how far a person
/// holds a scanner askew.
inline constexpr double kCone_deg = 12;

// ---- walls, floor and ceiling

/// Distance of two copies of one wall, floor or ceiling, m. Scanners: drift parts them by up to this; boards and
/// cabinets stand farther off the wall behind them, steps farther above the floor.
inline constexpr double kSameSurface_m = 0.045;
/// Share of a wall's area from which on a second sheet of it is its copy, and counts in its place. Less is stragglers,
/// or a thin thing on the wall; see docs/verification/scans.md.
inline constexpr double kLeastCopy = 0.1;
/// Corners are rounded, hidden or not scanned so far, m: the depth of a shelf or a curtain.
inline constexpr double kSnap_m = 0.25;
/// Gap in a wall, of a curtain, a pillar or a cabinet as high as the room, m. Building practice: cabinets are 0.6 deep.
inline constexpr double kWallGap_m = 0.6;
/// Walls and roofs end this far below the ceiling at most, m: what trunking, lamps and a scan's own rim take.
inline constexpr double kBelowTop_m = 0.3;
/// Narrowest wall, m, and smallest area that a scan has to have of one.
inline constexpr double kLeastWall_m = 0.3, kLeastSeen_m2 = 0.2;
/// A narrower upright plane as high as the room may be a pillar's, m. Building practice.
inline constexpr double kPillar_m = 1.2;
/// Nothing of a scan lies behind what bounds a room: from a wall's own thickness on, as far as the next room goes, m;
/// and the share of the bound's own samples that stragglers, ghosts and doorways may come to.
inline constexpr double kBehind_m[2] = {0.15, 3}, kSeenBehind = 0.1;
/// Smallest window or doorway, m and m2. Building practice; smaller gaps are where a scan has none.
inline constexpr double kLeastHole_m = 0.35, kLeastHole_m2 = 0.2;
/// What stands so far before a wall may hide it from a scanner, m: twice a cabinet's depth, since it looks aslant.
inline constexpr double kHides_m = 2 * kWallGap_m;
/// Lower upright planes than that, m, are no walls where no ceiling says how high walls are: a door's height.
inline constexpr double kLowWall_m = 1.9;

// ---- up

/// The smallest of a room's three sizes lies within these, up to a hall's height, and the largest below that, m.
inline constexpr double kRoom_m[2] = {1.0, 9.0}, kWidest_m = 150;
/// A plane as large, m2, is the room's own: tops and sides of furniture are smaller.
inline constexpr double kShell_m2 = 3;
/// Height from which on a level plane over the floor is a ceiling, m: a person stands below.
inline constexpr double kLeastCeiling_m = 1.8;
/// Share of the largest level plane that a floor or a ceiling has at least.
inline constexpr double kShareOfLargestLevel = 0.25;

// ---- things

/// Neighbours on one surface, voxels, and the same whatever the thinning, m: two edges of a voxel and their noise.
inline constexpr double kTouching_voxels = 2.6, kTouching_m = kTouching_voxels * kFinest_m;
/// Smallest thing, m2 of surface: two hands.
inline constexpr double kLeastThing_m2 = 0.06;
/// A thing of no sure class has to be larger, m2: what is smaller than a chair's back nobody could name, or give a
/// material. And how sure a class has to be.
inline constexpr double kLeastUnsure_m2 = 0.25, kSure = 0.5;
/// Bodies end so far from what they stand on, m, so that no faces coincide: twice the limit of coplanar facets (5 mm).
inline constexpr double kGap_m = 0.01;
/// Thickness of a plate of which one face is known, m: the same limit, for its two faces.
inline constexpr double kThinnest_m = kGap_m;
/// Upright plate that is a part by itself, m2: half of a door's leaf and more; and how thick it is at most, m: an inner
/// wall.
inline constexpr double kLeastPlate_m2 = 0.5, kThickestPlate_m = 0.25;
/// Distance within which a sample is on a shape, m, where the scan's noise is smaller: edges are rounded by so much.
inline constexpr double kLeastFit_m = 0.015;
/// Heights of table tops, the height below which a level plate may be a seat, and the thickness of a top at most, m.
/// Furniture.
inline constexpr double kTop_m[2] = {0.25, 1.25}, kLowTable_m = 0.58, kSlab_m = 0.05;

}  // namespace mmradartwin::bounds
