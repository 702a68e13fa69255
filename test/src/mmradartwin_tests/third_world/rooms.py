"""Seven kinds of rooms, drawn by a seed: what a scan shows (walls and furniture as boxes) and what it does not."""
import dataclasses
import math

import numpy as np

from mmradartwin_tests.third_world.surfaces import Box

# Permittivity at 77 GHz (ITU-R P.2040) as (eps', conductivity S/m), None for metal; share that scatters.
TAGS = {"Concrete": (5.24, 1.38, 0.2), "Plaster": (2.94, 0.251, 0.15), "Wood": (1.99, 0.494, 0.1),
        "TableTop": (2.58, 0.643, 0.0), "Glass": (6.31, 1.211, 0.0), "Plastic": (2.57, 0.49, 0.0),
        "Carpet": (2.08, 0.0317, 0.3), "Metal": (None, None, 0.0)}


@dataclasses.dataclass
class Furniture:
    """A piece: width along its wall, depth, height, the height it begins at; on a wall or free on the floor."""
    tag: str
    width_m: tuple
    depth_m: tuple
    height_m: tuple
    from_m: float = 0.01
    free: bool = False
    legs: bool = False


PIECES = {
    "cabinet": Furniture("Metal", (0.8, 1.0), (0.4, 0.5), (1.7, 1.95)),
    "locker": Furniture("Metal", (0.6, 1.2), (0.5, 0.55), (1.8, 1.9)),
    "wardrobe": Furniture("Wood", (1.0, 1.5), (0.55, 0.65), (1.9, 2.1)),
    "bookshelf": Furniture("Wood", (0.8, 1.2), (0.28, 0.35), (1.8, 2.0)),
    "fridge": Furniture("Metal", (0.58, 0.65), (0.6, 0.65), (1.5, 1.8)),
    "whiteboard": Furniture("Metal", (1.2, 2.0), (0.025, 0.035), (1.0, 1.2), 0.85),
    "screen": Furniture("Glass", (0.9, 1.4), (0.05, 0.08), (0.6, 0.8), 0.95),
    "window": Furniture("Glass", (1.2, 2.2), (0.025, 0.035), (1.2, 1.3), 0.9),
    "radiator": Furniture("Metal", (0.9, 1.6), (0.08, 0.12), (0.5, 0.6), 0.12),
    "door": Furniture("Wood", (0.85, 0.95), (0.04, 0.05), (2.0, 2.1)),
    "desk": Furniture("TableTop", (1.2, 1.6), (0.7, 0.8), (0.025, 0.035), 0.71, legs=True),
    "table": Furniture("TableTop", (1.6, 2.4), (0.8, 1.0), (0.03, 0.04), 0.71, free=True, legs=True),
    "sofa": Furniture("Carpet", (1.4, 1.9), (0.75, 0.9), (0.7, 0.85)),
    "pillar": Furniture("Concrete", (0.35, 0.5), (0.35, 0.5), (2.4, 2.5), free=True),
    "partition": Furniture("Plastic", (1.0, 1.6), (0.04, 0.06), (1.5, 1.7), free=True),
    "rack": Furniture("Metal", (0.6, 0.8), (0.6, 0.9), (1.6, 1.9), free=True),
    "crate": Furniture("Wood", (0.5, 0.8), (0.5, 0.8), (1.1, 1.4), free=True),
}


@dataclasses.dataclass
class Kind:
    """Size, what the walls are made of (one wall may differ), pieces, small things per square metre of floor."""
    size_m: tuple
    walls: str
    odd_wall: str
    pieces: tuple
    things_per_m2: float


KINDS = {
    "small_office": Kind((4.2, 3.6, 2.6), "Plaster", "Concrete",
                         ("desk", "cabinet", "bookshelf", "window", "whiteboard"), 2.0),
    "meeting_room": Kind((6.2, 4.8, 2.8), "Plaster", "Glass",
                         ("table", "screen", "whiteboard", "cabinet", "door"), 1.2),
    "laboratory": Kind((8.0, 6.0, 3.0), "Concrete", "Concrete",
                       ("rack", "rack", "cabinet", "locker", "desk", "desk", "window", "pillar", "whiteboard"), 2.5),
    "corridor": Kind((9.0, 2.6, 2.6), "Concrete", "Wood", ("locker", "radiator", "door", "door", "cabinet"), 0.6),
    "store": Kind((5.4, 4.4, 2.8), "Concrete", "Concrete",
                  ("cabinet", "locker", "crate", "crate", "rack", "bookshelf"), 3.0),
    "living_room": Kind((5.6, 4.6, 2.5), "Plaster", "Plaster",
                        ("sofa", "wardrobe", "screen", "window", "bookshelf", "fridge"), 1.8),
    "hall": Kind((9.2, 7.0, 3.2), "Concrete", "Wood",
                 ("pillar", "pillar", "partition", "partition", "cabinet", "window", "window", "table"), 0.8),
}


@dataclasses.dataclass
class Piece:
    """An actor of the scan: a named box."""
    name: str
    tag: str
    box: Box
    legs: bool


@dataclasses.dataclass
class Plan:
    """A room as it was scanned. walls: {actor: tag}."""
    kind: str
    size_m: np.ndarray
    walls: dict
    pieces: list
    things: int

    def piece(self, name):
        """A piece by its name."""
        return next(p for p in self.pieces if p.name == name)

    def tags(self):
        """{tag: number of actors}."""
        every = [p.tag for p in self.pieces] + list(self.walls.values())
        return {tag: every.count(tag) for tag in dict.fromkeys(every)}


def footprint_distance(box, points, margin_m=0.0):
    """[P] distance of places on the floor to a box's outline, 0 inside."""
    local = (np.atleast_2d(points)[:, :2] - box.center[:2]) @ box.axes()[:2, :2].T
    beyond = np.maximum(np.abs(local) - box.size[:2] / 2 - margin_m, 0.0)
    return np.hypot(beyond[:, 0], beyond[:, 1])


def outline(box):
    """Places along a box's outline on the floor, and its middle."""
    w, d = box.size[:2] / 2
    t = np.linspace(-1, 1, 15)
    ring = np.concatenate([np.stack([t * w, np.full(15, s * d)], 1) for s in (-1, 0, 1)] +
                          [np.stack([np.full(15, s * w), t * d], 1) for s in (-1, 1)])
    return ring @ box.axes()[:2, :2] + box.center[:2]


def collide(a, b, margin_m):
    """Whether two boxes stand closer than a margin, where they share a height."""
    if abs(a.center[2] - b.center[2]) > (a.size[2] + b.size[2]) / 2:
        return False
    return bool((footprint_distance(a, outline(b)) < margin_m).any() or
                (footprint_distance(b, outline(a)) < margin_m).any())


def place(rng, furniture, size_m, others):
    """A box for a piece that collides with nothing, or None."""
    for _ in range(300):
        w, d, h = (rng.uniform(*span) for span in (furniture.width_m, furniture.depth_m, furniture.height_m))
        z = furniture.from_m + h / 2
        if furniture.free:
            yaw = rng.uniform(-math.pi / 2, math.pi / 2)
            reach = math.hypot(w, d) / 2 + 0.5
            if min(size_m[:2]) < 2 * reach:
                continue
            center = [rng.uniform(reach, size_m[0] - reach), rng.uniform(reach, size_m[1] - reach), z]
        else:
            wall = rng.integers(4)
            along, across = (0, 1) if wall < 2 else (1, 0)
            lean = rng.normal(0, math.radians(1.2)) if d > 0.2 else rng.normal(0, math.radians(0.2))
            off = d / 2 + rng.uniform(0.012, 0.03) + w / 2 * abs(math.sin(lean))
            if size_m[along] < w + 0.6:
                continue
            center = [0.0, 0.0, z]
            center[along] = rng.uniform(w / 2 + 0.2, size_m[along] - w / 2 - 0.2)
            center[across] = off if wall % 2 == 0 else size_m[across] - off
            yaw = lean + (0.0 if wall < 2 else math.pi / 2)
        box = Box(np.array(center), np.array([w, d, h]), yaw)
        if not any(collide(box, o, 0.35 if furniture.free else 0.06) for o in others):
            return box
    return None


def draw_plan(rng, kind_name=None):
    """A room of a kind, or of any."""
    kind_name = kind_name or str(rng.choice(list(KINDS)))
    kind = KINDS[kind_name]
    size_m = np.array(kind.size_m) * rng.uniform([0.92, 0.92, 1.0], [1.08, 1.08, 1.0])
    walls = {name: kind.walls for name in ("wall_south", "wall_north", "wall_west", "wall_east")}
    walls[str(rng.choice(list(walls)))] = kind.odd_wall
    pieces, numbers = [], {}
    for name in kind.pieces:
        box = place(rng, PIECES[name], size_m, [p.box for p in pieces])
        if box is None:
            continue
        numbers[name] = numbers.get(name, 0) + 1
        pieces.append(Piece(f"{name}_{numbers[name]}", PIECES[name].tag, box, PIECES[name].legs))
    return Plan(kind_name, size_m, walls, pieces, int(kind.things_per_m2 * size_m[0] * size_m[1]))


def line(a, b, radius_m, rng, slack_m=0.0):
    """(points, amplitudes) of a thin metal rod or cable from a to b: the root of k a for each metre of its length."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    count = max(2, int(np.linalg.norm(b - a) / 0.004))
    t = (np.arange(count) + 0.5) / count
    points = a + t[:, None] * (b - a)
    points[:, 2] -= slack_m * 4 * t * (1 - t)
    if slack_m:
        points[:, :2] += slack_m * np.sin(2 * np.pi * t * rng.integers(1, 3))[:, None] * rng.uniform(-0.5, 0.5, 2)
    points[:, 2] = np.maximum(points[:, 2], 0.01)
    step = np.linalg.norm(b - a) / count
    return points, np.full(count, step * math.sqrt(2 * math.pi / 0.00385 * radius_m), complex)


def draw_things(rng, plan, rods=True, things=True):
    """[(points, amplitudes)] of what no scan shows: legs, chairs, cables, things on tables and about the room."""
    found = []
    if rods:
        for piece in plan.pieces:
            if not piece.legs:
                continue
            axes, (w, d, _), bottom = piece.box.axes(), piece.box.size, piece.box.center[2] - piece.box.size[2] / 2
            for sx in (-1, 1):
                for sy in (-1, 1):
                    foot = piece.box.center + sx * (w / 2 - 0.05) * axes[0] + sy * (d / 2 - 0.05) * axes[1]
                    found.append(line([*foot[:2], 0.01], [*foot[:2], bottom], 0.02, rng))
            edge = piece.box.center + (d / 2) * axes[1]
            found.append(line([*edge[:2], bottom], [*(edge[:2] + rng.normal(0, 0.3, 2)), 0.02], 0.003, rng, 0.1))
        for _ in range(2):          # lamps and pipes on the walls
            x = rng.uniform(0.3, plan.size_m[0] - 0.3)
            y = rng.choice([0.03, plan.size_m[1] - 0.03])
            found.append(line([x, y, 0.3], [x + rng.normal(0, 0.05), y, 2.2], 0.002, rng))
    if things:
        spread = plan.size_m - [0.3, 0.3, 0.4]
        points = rng.uniform([0.15, 0.15, 0.05], [*(spread[:2] + 0.15), 1.6], (plan.things, 3))
        points = points[[all(footprint_distance(p.box, q)[0] > 0.05 for p in plan.pieces) for q in points]]
        found.append(areas(rng, points, -34.0))
        for piece in plan.pieces:
            if piece.legs:
                w, d, _ = piece.box.size / 2
                count = rng.integers(4, 9)
                local = rng.uniform([-0.9 * w, -0.9 * d, 0.03], [0.9 * w, 0.9 * d, 0.25], (count, 3))
                found.append(areas(rng, local @ piece.box.axes() + piece.box.center, -27.0))
    return found


def areas(rng, points, median_dbsm):
    """Points with echo areas that scatter by 5 dB, and phases of their own."""
    level_db = median_dbsm + 5 * rng.standard_normal(len(points))
    return points, 10**(level_db / 20) * np.exp(2j * np.pi * rng.random(len(points)))
