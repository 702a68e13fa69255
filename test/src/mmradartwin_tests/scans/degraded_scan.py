"""Degraded scans of known rooms: what was seen from some places, with noise, holes, ghosts, doubled and rounded surfaces."""
import dataclasses
import math

import numpy as np

from mmradartwin_tests.geometry import rotation_z
from mmradartwin_tests.scans.distance_grid import DistanceGrid
from mmradartwin_tests.scans.ray_casting import CastRoom

LOWEST_RAD, HIGHEST_RAD = math.radians(-72.0), math.radians(80.0)   # of a scanner's rays
NOISE_LENGTH_STEPS = 6      # over which a reconstruction's errors are alike
SEEN = 0.79                 # of the area of floor, walls and furniture: what is seen of it, about
JUMP = 0.08                 # of the distance: neighbouring rays that differ more see different things
COLORS = {"Metal": (150, 155, 165), "Concrete": (205, 203, 196), "Plaster": (225, 222, 215), "Wood": (150, 102, 55),
          "TableTop": (205, 175, 130), "Carpet": (85, 95, 125), "Glass": (120, 160, 170), "Plastic": (215, 215, 205)}


@dataclasses.dataclass
class Degradation:
    """How a scan was made and what is wrong with it.

    kind: "cloud" (points of a standing scanner), "frames" (a mesh for each place of a depth camera, laid over each other:
    doubled surfaces) or "fused" (one mesh of the whole, as depth fusion makes it: rounded edges).
    """
    name: str
    kind: str = "fused"
    size: int = 1000000            # triangles of a mesh, points of a cloud
    places: int = 5                # of the scanner
    noise_m: float = 0.004         # 1 sigma, along the ray or the normal
    smooth_steps: float = 0.0      # of a fused mesh: blur of the distances, in cells
    unseen: bool = False           # a fused mesh closes what nobody saw, as Poisson's method does
    holes: int = 0
    ghosts: float = 0.0            # share of the rays on glass and metal that show a mirrored room behind it
    blind_glass: bool = False      # glass returns nothing
    place_error_m: float = 0.0     # of the scanner's place, 1 sigma on each axis: surfaces of two places lie apart
    place_error_deg: float = 0.0
    y_up: bool = False
    unit_m: float = 1.0            # a coordinate of 1 is so many metres
    tilt_deg: float = 0.0
    yaw_deg: float = 0.0
    offset_m: tuple = (0.0, 0.0, 0.0)
    colors: bool = False


@dataclasses.dataclass
class Scan:
    """points [V, 3] in the scan's own frame and unit; faces [F, 3] or None; colors [V, 3] of 0 to 255 or None.
    T_scan_map [4, 4]: p_scan = T p_map, with the unit's factor in it. step_m: distance of neighbouring points, at 3 m of
    a scanner's."""
    points: np.ndarray
    faces: np.ndarray
    colors: np.ndarray
    T_scan_map: np.ndarray
    step_m: float


def scan_frame(degradation):
    """[4, 4] p_scan = T p_map: turned about z, tilted, shifted, perhaps y up, and in the scan's unit."""
    d = degradation
    a = math.radians(d.tilt_deg)
    # The tilt is about an axis between x and y, so that both see some of it.
    axis = np.array([math.cos(0.6), math.sin(0.6), 0.0])
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    tilt = np.eye(3) + math.sin(a) * k + (1 - math.cos(a)) * k @ k
    rotation = tilt @ rotation_z(math.radians(d.yaw_deg))
    shift = np.array(d.offset_m, float)
    if d.y_up:
        swap = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])     # (x, y, z) -> (x, z, -y)
        rotation, shift = swap @ rotation, swap @ shift
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation / d.unit_m, shift / d.unit_m
    return T


def jittered(rng, degradation):
    """A small turn [3, 3] and shift [3]: how far a place of the scanner is known wrong."""
    w = np.radians(degradation.place_error_deg) * rng.standard_normal(3)
    turn = np.eye(3) + np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    turn, _ = np.linalg.qr(turn)
    turn *= np.sign(np.diag(turn))
    return turn, degradation.place_error_m * rng.standard_normal(3)


def cast_with_faults(cast, place, directions, degradation, rng):
    """(distance_m [P], actor [P]): what a scanner reads, with noise, ghosts and blind glass; inf and -1 where nothing."""
    distance, which = cast.cast(place, directions)
    actor = np.where(which >= 0, cast.actor[which], -1)
    tag = np.where(which >= 0, cast.tags[actor], "")
    if degradation.ghosts > 0:
        mirror = np.flatnonzero(((tag == "Glass") | (tag == "Metal")) & (rng.random(len(tag)) < degradation.ghosts))
        d, n = directions[mirror], cast.normal[which[mirror]]
        onward = d - 2 * (d * n).sum(axis=1)[:, None] * n
        start = place + distance[mirror, None] * d + 1e-3 * onward
        beyond, hit = cast.cast(start, onward)
        distance[mirror] += np.where(hit >= 0, beyond, np.inf)
    if degradation.blind_glass:
        distance[(tag == "Glass") & (rng.random(len(tag)) < 0.97)] = np.inf
    distance += (degradation.noise_m * rng.standard_normal(len(distance))).astype(np.float32)
    return distance, actor


def scanned_cloud(room, degradation, rng):
    """(points, None, actor of each, step)."""
    cast, points, owner = CastRoom(room), [], []
    each = degradation.size // degradation.places
    for place in room.standpoints(rng, degradation.places):
        height = rng.uniform(math.sin(LOWEST_RAD), math.sin(HIGHEST_RAD), each)
        azimuth = rng.uniform(-math.pi, math.pi, each)
        flat = np.sqrt(1 - height**2)
        directions = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), height], axis=1)
        distance, actor = cast_with_faults(cast, place, directions, degradation, rng)
        kept = np.isfinite(distance)
        turn, shift = jittered(rng, degradation)
        points.append(place + shift + distance[kept, None] * directions[kept] @ turn.T)
        owner.append(actor[kept])
    step_m = 3.0 * math.sqrt(2 * math.pi * (math.sin(HIGHEST_RAD) - math.sin(LOWEST_RAD)) / degradation.size)
    return np.concatenate(points), None, np.concatenate(owner), step_m


def scanned_frames(room, degradation, rng):
    """(points, faces, actor of each, step): a mesh for each place, its rays on a grid of angles."""
    cast = CastRoom(room)
    span = HIGHEST_RAD - LOWEST_RAD
    rows = int(math.sqrt(degradation.size / (2 * degradation.places) * span / (2 * math.pi)))
    columns = int(degradation.size / (2 * degradation.places) / rows)
    azimuth = 2 * math.pi * np.arange(columns) / columns
    elevation = LOWEST_RAD + span * (np.arange(rows) + 0.5) / rows
    directions = np.stack([np.outer(np.cos(elevation), np.cos(azimuth)), np.outer(np.cos(elevation), np.sin(azimuth)),
                           np.outer(np.sin(elevation), np.ones(columns))], axis=-1).reshape(-1, 3)
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b = number[:-1], number[1:]
    quads = np.stack([a, np.roll(a, -1, axis=1), np.roll(b, -1, axis=1), b], axis=-1).reshape(-1, 4)
    points, faces, owner, base = [], [], [], 0
    for place in room.standpoints(rng, degradation.places):
        distance, actor = cast_with_faults(cast, place, directions, degradation, rng)
        four = distance[quads]
        with np.errstate(invalid="ignore"):
            joined = np.isfinite(four).all(axis=1) & (np.ptp(four, axis=1) < JUMP * four.min(axis=1) + 0.01)
        turn, shift = jittered(rng, degradation)
        ends = np.where(np.isfinite(distance), distance, 0.0)
        points.append(place + shift + ends[:, None] * directions @ turn.T)
        owner.append(actor)
        faces.append(triangles_of(quads[joined]) + base)
        base += len(directions)
    points, faces, owner = compact(np.concatenate(points), np.concatenate(faces), np.concatenate(owner))
    return points, faces, owner, 3.0 * span / rows


def triangles_of(quads):
    """[2 Q, 3] triangles of quads [Q, 4]."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def compact(points, faces, *more):
    """Only the points that faces use, with their faces; further arrays of points likewise."""
    used = np.zeros(len(points), bool)
    used[faces.ravel()] = True
    number = np.cumsum(used) - 1
    return (points[used], number[faces], *(m[used] for m in more))


def surface_area(room):
    """Area of all that a scan of a room may show, m2; coarse."""
    low, high = room.outline.min(axis=0), room.outline.max(axis=0)
    area = 2 * np.prod(high - low) + sum(w.length_m for w in room.walls()) * room.height_m
    for part in (p for actor in room.furniture for p in actor.parts):
        area += sum(r.s1 * r.s2 for r in part.rectangles())
    return float(area)


def even_field(rng, points, length_m):
    """[P] random numbers of about unit variance, alike within length_m: trilinear between random nodes."""
    low = points.min(axis=0) - length_m
    at = (points - low) / length_m
    shape = np.ceil(at.max(axis=0)).astype(int) + 2
    nodes = rng.standard_normal(shape)
    whole = np.floor(at).astype(int)
    t = at - whole
    value, square = np.zeros(len(points)), np.zeros(len(points))
    for a in (0, 1):
        for b in (0, 1):
            for c in (0, 1):
                weight = np.prod(np.where([a, b, c], t, 1 - t), axis=1)
                value += weight * nodes[whole[:, 0] + a, whole[:, 1] + b, whole[:, 2] + c]
                square += weight**2
    return value / np.sqrt(square)


def vertex_normals(points, quads):
    """[V, 3] unit normals towards the air."""
    across = np.cross(points[quads[:, 2]] - points[quads[:, 0]], points[quads[:, 3]] - points[quads[:, 1]])
    total = np.stack([np.bincount(quads.ravel(), np.repeat(across[:, k], 4), len(points)) for k in range(3)], axis=1)
    return total / np.maximum(np.linalg.norm(total, axis=1), 1e-12)[:, None]


def fused_mesh(room, degradation, rng):
    """(points, faces, actor of each or -1, step): the surface of the room's distances on a grid."""
    step_m = math.sqrt(SEEN * 2 * surface_area(room) / degradation.size)
    grid = DistanceGrid(room, step_m)
    if degradation.smooth_steps > 0:
        grid.smooth(degradation.smooth_steps)
    points, quads = grid.surface()
    del grid
    cast = CastRoom(room)
    normals = vertex_normals(points, quads)
    if not degradation.unseen:
        places = room.standpoints(rng, degradation.places)
        middle = points[quads].mean(axis=1)
        front = normals[quads[:, 0]]
        # From just in front of the surface, so that its own roundness does not hide it.
        seen = cast.seen(middle + step_m * front, places, 2 * step_m)
        points, quads, normals = compact(points, quads[seen], normals)
    # 70 % of the error's power is alike over some cells, as fused depth images have it.
    white = rng.standard_normal(len(points))
    even = even_field(rng, points, NOISE_LENGTH_STEPS * step_m)
    points = points + degradation.noise_m * (math.sqrt(0.7) * even + math.sqrt(0.3) * white)[:, None] * normals
    owner = np.full(len(points), -1)
    if degradation.colors:
        _, which = cast.cast(points + 4 * step_m * normals, -normals)
        owner = np.where(which >= 0, cast.actor[which], -1)
    return points, triangles_of(quads), owner, step_m


def cut_holes(points, faces, owner, count, rng):
    """Takes the points within count balls of 10 to 35 cm out, as where nobody held the camera."""
    keep = np.ones(len(points), bool)
    for _ in range(count):
        middle = points[rng.integers(len(points))]
        keep &= ((points - middle)**2).sum(axis=1) > rng.uniform(0.10, 0.35)**2
    if faces is None:
        return points[keep], None, owner[keep]
    return compact(points, faces[keep[faces].all(axis=1)], owner)


def make_scan(room, degradation, seed):
    """A Scan of a KnownRoom; the same bytes for the same seed."""
    rng = np.random.default_rng([seed, 1949])
    make = {"cloud": scanned_cloud, "frames": scanned_frames, "fused": fused_mesh}[degradation.kind]
    points, faces, owner, step_m = make(room, degradation, rng)
    if degradation.holes:
        points, faces, owner = cut_holes(points, faces, owner, degradation.holes, rng)
    colors = None
    if degradation.colors:
        tags = [a.tag for a in room.actors()]
        table = np.array([COLORS[t] for t in tags] + [(128, 128, 128)], float)      # the last is that of -1
        colors = np.clip(table[owner] + 6 * rng.standard_normal((len(owner), 3)), 0, 255).astype(np.uint8)
    T = scan_frame(degradation)
    return Scan(points @ T[:3, :3].T + T[:3, 3], faces, colors, T, step_m)


# What stands in docs/verification/scans.md: each fault at least once, each kind of scan at least twice.
DEGRADATIONS = {d.name: d for d in (
    Degradation("phone", size=800000, noise_m=0.005, smooth_steps=0.5, holes=4, y_up=True, unit_m=1e-3, colors=True),
    Degradation("fused_fine", noise_m=0.003, colors=True),
    Degradation("fused_mm_y_up", noise_m=0.005, size=700000, smooth_steps=0.6, holes=6, y_up=True, unit_m=1e-3,
                yaw_deg=23.0, offset_m=(1.2, -3.1, 1.03)),
    Degradation("poisson", noise_m=0.006, size=1000000, smooth_steps=1.0, unseen=True, tilt_deg=5.0, yaw_deg=-31.0,
                offset_m=(-2.0, 0.7, -0.4)),
    Degradation("lidar_cloud", kind="cloud", noise_m=0.003, places=6, holes=4, ghosts=0.3, blind_glass=True,
                yaw_deg=11.0, offset_m=(0.0, 0.0, -1.5)),
    Degradation("noisy_cloud", kind="cloud", noise_m=0.015, places=8, holes=8, yaw_deg=40.0, y_up=True, colors=True),
    Degradation("doubled_frames", kind="frames", noise_m=0.004, places=8, place_error_m=0.006, place_error_deg=0.15,
                yaw_deg=5.0, tilt_deg=1.0),
    Degradation("far_coordinates", noise_m=0.008, size=600000, holes=10, offset_m=(431200.0, 5412300.0, 312.0)),
    Degradation("three_million", noise_m=0.004, size=3000000, smooth_steps=1.0, tilt_deg=5.0, yaw_deg=60.0, holes=5))}
