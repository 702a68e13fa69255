"""A scene that was made of a scan, held against the room that is known."""
import dataclasses
import math
import os

import numpy as np
import yaml
from scipy.spatial import cKDTree

from mmradartwin_tests.scans.known_room import rectangles_of

# Classes that answer for a piece of furniture, by how its name begins. What a box on the floor is for, its shape alone
# does not tell.
CUPBOARD = ("cabinet", "bookshelf", "wardrobe")
ANSWERS = {"cabinet": CUPBOARD, "locker": CUPBOARD, "wardrobe": CUPBOARD, "bookshelf": CUPBOARD, "fridge": CUPBOARD,
           "rack": CUPBOARD, "crate": CUPBOARD, "desk": ("table",), "table": ("table",), "chair": ("chair",),
           "sofa": ("sofa",), "pillar": ("pillar",), "partition": ("partition",), "bin": ("bin",), "printer": ("device",),
           "monitor": ("screen",), "shelf": ("shelf",), "radiator": ("radiator",),
           "door": ("door",), "window": ("window",), "whiteboard": ("board", "panel"), "screen": ("screen", "board"),
           "tv": ("screen", "board"), "carpet": ("carpet",)}
SCANNED_M, SCANNED_SHARE = 0.03, 0.3     # a piece is in the scan where so much of its surface has a point as near as that
FLAT_M = 0.07        # thinner things on walls or floor are surface, no furniture
LEAST_WALL_M = 0.5


@dataclasses.dataclass
class Measured:
    """What came out. Errors of walls: [(name, offset m, angle deg)], absent walls with nan."""
    floor_m: float
    tilt_deg: float
    walls: list
    wall_share: float         # of the walls' area that the scan has: what the scene's planes hold
    furniture: list           # (name, what it was said to be or "", right)
    flat: list                # likewise, for what is thinner than FLAT_M
    extra: list               # things that stand for nothing
    unscanned: list           # pieces of which the scan has too little
    quality: dict


def read_obj(path):
    """{object: [T, 3, 3] corners of its triangles}."""
    vertices, objects, name = [], {}, ""
    with open(path, encoding="utf-8") as lines:
        for line in lines:
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                vertices.append([float(w) for w in words[1:4]])
            elif words[0] in ("o", "g"):
                name = " ".join(words[1:])
            elif words[0] == "f":
                corners = [int(w.split("/")[0]) - 1 for w in words[1:]]
                for i in range(1, len(corners) - 1):
                    objects.setdefault(name, []).append([corners[0], corners[i], corners[i + 1]])
    vertices = np.array(vertices)
    return {n: vertices[np.array(t)] for n, t in objects.items()}


def read_summary(folder):
    """What make_scene says of its scene: the keys of scan.yaml and of quality.yaml."""
    said = {}
    for name in ("scan.yaml", "quality.yaml"):
        with open(os.path.join(folder, name), encoding="utf-8") as text:
            said.update(yaml.safe_load(text))
    return said


def fitted_plane(triangles):
    """(unit normal, centre, area m2, spread m) of a flat set of triangles [T, 3, 3]."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(across, axis=1) / 2
    across[across @ across[area.argmax()] < 0] *= -1      # winding means nothing
    normal = across.sum(axis=0)
    normal /= np.linalg.norm(normal)
    center = (area[:, None] * triangles.mean(axis=1)).sum(axis=0) / area.sum()
    return normal, center, float(area.sum()), float(np.abs((triangles - center) @ normal).max())


def map_from_truth(quality, scan):
    """[4, 4] p_map = T p_room, by the frame that make_scene says it found."""
    T = np.eye(4)
    T[:3] = quality["T_map_file"]
    T[:3, :3] = T[:3, :3] * quality["unit_m"]
    return T @ scan.T_scan_map


def kind_of(name):
    """Beginning of an actor's name: "cabinet" of "cabinet_north"."""
    return name.split("_")[0]


def bounds_of(actor, T):
    """(low [3], high [3]) of a known actor in map."""
    corners = np.array([r.origin + a * r.s1 * r.e1 + b * r.s2 * r.e2 for part in actor.parts for r in rectangles_of(part)
                        for a in (0, 1) for b in (0, 1)])
    corners = corners @ T[:3, :3].T + T[:3, 3]
    return corners.min(axis=0), corners.max(axis=0)


def grouped(room, T):
    """{name: (low, high, least thickness)} of the furniture; parts of one desk are one piece."""
    groups = {}
    for actor in room.furniture:
        name = actor.name
        for part in ("_top", "_legs", "_panel"):
            name = name.removesuffix(part)
        low, high = bounds_of(actor, T)
        sizes = [min(p.size) for p in actor.parts if hasattr(p, "size")]
        thin = len(actor.parts) == 1 and sizes and sizes[0] < FLAT_M
        if name in groups:
            low, high = np.minimum(low, groups[name][0]), np.maximum(high, groups[name][1])
        groups[name] = (low, high, bool(thin) and name == actor.name)
    return groups


def scanned_share(actors, scan):
    """Share of the surfaces of known actors that the scan has: their sides that can be seen, by points 5 cm apart, near
    which the scan has a point."""
    T = scan.T_scan_map
    places = []
    for r in (r for actor in actors for part in actor.parts for r in rectangles_of(part)):
        if np.cross(r.e1, r.e2)[2] < -0.5:
            continue       # undersides
        u, v = (np.arange(0.02, s, 0.05) if s > 0.05 else np.array([s / 2]) for s in (r.s1, r.s2))
        places.append((r.origin + u[:, None, None] * r.e1 + v[None, :, None] * r.e2).reshape(-1, 3))
    places = np.concatenate(places) @ T[:3, :3].T + T[:3, 3]
    unit = np.linalg.norm(T[:3, 0])
    near = np.concatenate([places.min(axis=0), places.max(axis=0)]).reshape(2, 3) + [[-0.1 * unit] * 3, [0.1 * unit] * 3]
    points = scan.points[((scan.points > near[0]) & (scan.points < near[1])).all(axis=1)]
    if not len(points):
        return 0.0
    distance, _ = cKDTree(points).query(places)
    return float(np.mean(distance < SCANNED_M * unit))


def overlap(a, b):
    """Share of their union that two boxes (low, high) have in common; each is at least 10 cm thick."""
    def thick(box):
        grow = np.maximum(0.1 - (box[1] - box[0]), 0) / 2
        return box[0] - grow, box[1] + grow
    (al, ah), (bl, bh) = thick(a), thick(b)
    common = np.prod(np.maximum(np.minimum(ah, bh) - np.maximum(al, bl), 0))
    return common / (np.prod(ah - al) + np.prod(bh - bl) - common)


def slant_errors(room, T, planes):
    """Likewise of the slanted faces that bound the room: of each such body, the face that looks down most."""
    found = []
    for slant in room.slants:
        faces = [r for part in slant.parts for r in rectangles_of(part)]
        face = min(faces, key=lambda r: np.cross(r.e1, r.e2)[2])
        normal = T[:3, :3] @ np.cross(face.e1, face.e2)
        normal /= np.linalg.norm(normal)
        middle = T[:3, :3] @ (face.origin + face.s1 / 2 * face.e1 + face.s2 / 2 * face.e2) + T[:3, 3]
        best = None
        for n, center, area, _ in planes.values():
            angle = math.degrees(math.acos(min(1.0, abs(n @ normal))))
            offset = abs((center - middle) @ normal)
            if angle < 5 and offset < 0.2 and area > 1 and (best is None or area > best[2]):
                best = (offset, angle, area)
        found.append((slant.name, *(best[:2] if best else (math.nan, math.nan))))
    return found


def wall_errors(room, T, planes):
    """[(name, offset m, angle deg)] of each known wall, by the found plane nearest to it; nan where none is."""
    found = []
    for wall in room.walls():
        if wall.length_m < LEAST_WALL_M:
            continue
        i = room.wall_names.index(wall.name)
        middle = np.append((room.outline[i] + room.outline[(i + 1) % len(room.outline)]) / 2, room.height_m / 2)
        normal, middle = T[:3, :3] @ wall.normal, T[:3, :3] @ middle + T[:3, 3]
        best = None
        for name, (n, center, area, _) in planes.items():
            angle = math.degrees(math.acos(min(1.0, abs(n @ normal))))
            offset = abs((center - middle) @ n)
            beside = np.linalg.norm(np.cross(normal, [0, 0, 1.0]) * ((center - middle) @ np.cross(normal, [0, 0, 1.0])))
            if angle < 5 and offset < 0.2 and beside < wall.length_m / 2 + 0.2:
                if best is None or area > best[2]:
                    best = (offset, angle, area)
        found.append((wall.name, *(best[:2] if best else (math.nan, math.nan))))
    return found


def wall_share(room, T, scan, planes):
    """Share of the walls' area that the scan has over which one of the planes {name: [T, 3, 3]} lies within SCANNED_M.

    By places 10 cm apart on the known walls and slants. What furniture covers the scan does not have."""
    places = []
    faces = [r for actor in room.shell()[2:] for r in actor.parts]
    faces += [min((r for part in s.parts for r in rectangles_of(part)), key=lambda r: np.cross(r.e1, r.e2)[2])
              for s in room.slants]
    for r in faces:
        u, v = np.arange(0.05, r.s1, 0.1), np.arange(0.05, r.s2, 0.1)
        places.append((r.origin + u[:, None, None] * r.e1 + v[None, :, None] * r.e2).reshape(-1, 3))
    places = np.concatenate(places)
    S = scan.T_scan_map
    near, _ = cKDTree(scan.points).query(places @ S[:3, :3].T + S[:3, 3])
    places = places[near < SCANNED_M * np.linalg.norm(S[:3, 0])]
    places = places @ T[:3, :3].T + T[:3, 3]
    held = np.zeros(len(places), bool)
    for triangles in planes.values():
        for a, b, c in triangles:
            normal = np.cross(b - a, c - a)
            area = np.linalg.norm(normal)
            if area < 1e-9:
                continue
            normal /= area
            off = (places - a) @ normal
            # Weights of the corners; a centimetre beyond an edge counts, too.
            inside = [np.cross(q - p, places - p) @ normal > -0.01 * np.linalg.norm(q - p) for p, q in ((a, b), (b, c), (c, a))]
            held |= (np.abs(off) < SCANNED_M) & np.all(inside, axis=0)
    return float(held.mean()) if len(held) else math.nan


def furniture_found(groups, things):
    """[(name, said class or "", right, flat)] and the things that stand for no piece."""
    rows, used = [], set()
    for name, (low, high, flat) in groups.items():
        best = max(things, key=lambda t: overlap((low, high), things[t][1:]), default=None)
        share = overlap((low, high), things[best][1:]) if best else 0.0
        said = things[best][0] if best and share > 0.2 else ""
        if said:
            used.add(best)
        rows.append((name, said, said in ANSWERS.get(kind_of(name), (kind_of(name),)), flat))
    return rows, sorted(set(things) - used)


def compare(folder, room, scan):
    """Measured, of a folder that make_scene wrote of a Scan of a KnownRoom."""
    quality = read_summary(folder)
    objects = read_obj(os.path.join(folder, "room.obj"))
    T = map_from_truth(quality, scan)
    flat = {p["name"]: fitted_plane(objects[p["name"]]) for p in quality["planes"] if p["name"] in objects}
    walls = wall_errors(room, T, {n: p for n, p in flat.items() if abs(p[0][2]) < 0.5}) + slant_errors(room, T, flat)
    things = {t["name"]: (t["class"], objects[t["name"]].min(axis=(0, 1)), objects[t["name"]].max(axis=(0, 1)))
              for t in quality["things"] if t["name"] in objects}
    for name in flat:
        if kind_of(name) in ("door", "window", "panel"):
            things[name] = (kind_of(name), objects[name].min(axis=(0, 1)), objects[name].max(axis=(0, 1)))
    groups = grouped(room, T)
    pieces = {name: [a for a in room.furniture if a.name == name or a.name.rsplit("_", 1)[0] == name] for name in groups}
    unscanned = [name for name in groups if len(scan.points) and scanned_share(pieces[name], scan) < SCANNED_SHARE]
    rows, extra = furniture_found(groups, things)
    rows = [r for r in rows if r[0] not in unscanned]
    up = T[:3, 2] / np.linalg.norm(T[:3, 2])
    return Measured(floor_m=float(T[2, 3] + T[2, :2] @ room.outline.mean(axis=0)),
                    tilt_deg=math.degrees(math.acos(min(1.0, abs(up[2])))), walls=walls,
                    wall_share=wall_share(room, T, scan, {n: objects[n] for n in flat}),
                    furniture=[r[:3] for r in rows if not r[3]], flat=[r[:3] for r in rows if r[3]], extra=extra,
                    unscanned=unscanned,
                    quality=quality)
