"""Where the radar stood: locations, headings, pose errors and the time plan of a measured session."""
import dataclasses
import math

import numpy as np

from mmradartwin_tests.geometry import rotation_z
from mmradartwin_tests.tracing import Pose

START_S = 1760000000
CLEARANCE_M = 0.4
SPACING_M = 0.45
# Standard deviations of the reported pose: each coordinate, heading. Tilt (gravity is known better) has a third.
POSE_ERROR = {"exact": (0.0, 0.0), "clean": (0.001, 0.05), "default": (0.003, 0.3), "office": (0.004, 0.3)}


@dataclasses.dataclass
class Station:
    """One pose of the campaign."""
    name: str
    location: str
    stamp_ns: int
    true: Pose
    reported: Pose


def rotation_from_vector(rotation_vector_rad):
    """Rotation matrix of a rotation vector [3]."""
    angle = np.linalg.norm(rotation_vector_rad)
    if angle < 1e-15:
        return np.eye(3)
    x, y, z = np.asarray(rotation_vector_rad) / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def quaternion(rotation):
    """x, y, z, w of a rotation matrix, w >= 0."""
    m = rotation
    k = np.array([
        [m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
        [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
        [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]]])
    q = np.linalg.eigh(k)[1][:, -1]
    return q if q[3] >= 0 else -q


def plan(room, rng, locations, headings, poses, frames, frame_period_s, tier, pause_s, duplicates):
    """List of Stations. `poses` (or None for all) thins the campaign to that many over fewer places."""
    per_place = [headings] * locations
    if poses is not None:
        places = min(locations, poses, max(1, math.ceil(math.sqrt(poses * locations / headings))))
        per_place = [poses // places + (1 if i < poses % places else 0) for i in range(places)]
    spots = _spots(room, rng, len(per_place))
    sigma_m, sigma_deg = POSE_ERROR[tier]
    stations, clock = [], START_S + round(float(rng.uniform(0, 3600)), 2)
    count = sum(per_place) + duplicates
    width = max(3, len(str(count)))

    def report(true):
        error = rotation_from_vector(np.radians(sigma_deg) * rng.standard_normal(3) * [1 / 3, 1 / 3, 1.0])
        return Pose(true.position + sigma_m * rng.standard_normal(3), true.rotation @ error)

    def add(location, true, reported):
        nonlocal clock
        stations.append(Station(f"{len(stations) + 1:0{width}d}", location, round(clock * 1000) * 1000000, true,
                                reported))
        clock += frames * frame_period_s + pause_s * rng.uniform(0.7, 1.3)

    for place, (spot, count_here) in enumerate(zip(spots, per_place)):
        start = rng.uniform(0, 2 * np.pi)
        for h in range(count_here):
            yaw = start + 2 * np.pi * h / count_here + np.radians(rng.normal(0, 2.0))
            true = Pose(spot, rotation_z(yaw) @ rotation_from_vector(np.radians(rng.normal(0, [0.3, 0.3, 0.0]))))
            add(f"{place + 1:02d}", true, report(true))
        clock += 3 * pause_s
    for first in rng.choice(len(stations), size=min(duplicates, len(stations)), replace=False):
        original = stations[first]
        true = Pose(original.true.position + [*rng.uniform(-0.02, 0.02, 2), rng.uniform(-0.004, 0.004)],
                    original.true.rotation @ rotation_z(np.radians(rng.uniform(-0.2, 0.2))))
        while True:
            reported = report(true)
            turn = reported.rotation.T @ original.reported.rotation
            angle = math.degrees(math.acos(min(1.0, (np.trace(turn) - 1) / 2)))
            offset = reported.position - original.reported.position
            if angle < 0.7 and abs(offset[2]) < 0.015 and np.hypot(*offset[:2]) < 0.08:
                break
        add(original.location, true, reported)
    return stations


def _spots(room, rng, count):
    """Positions clear of everything, well apart from each other."""
    low, high = room.origin.min(axis=0), (room.origin + room.s1[:, None] * room.e1 + room.s2[:, None]
                                          * room.e2).max(axis=0)
    spots, tries = [], 0
    while len(spots) < count:
        tries += 1
        if tries > 200000:
            raise ValueError(f"no room for {count} places {SPACING_M} m apart and {CLEARANCE_M} m clear of everything")
        p = np.array([rng.uniform(low[0], high[0]), rng.uniform(low[1], high[1]), rng.uniform(0.8, 1.4)])
        if any(np.hypot(*(p - q)[:2]) < SPACING_M for q in spots) or room.inside(p) or room.clearance(p) < CLEARANCE_M:
            continue
        spots.append(p)
    return spots
