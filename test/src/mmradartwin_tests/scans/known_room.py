"""Rooms of which everything is known: an outline with a height, and furniture of boxes, sheets and upright cylinders.

Coordinates are metres in `map`, z up, floor at 0.
"""
import dataclasses
import math

import numpy as np

from mmradartwin_tests import office
from mmradartwin_tests.geometry import Actor, Box, Cylinder, Rectangle, box, rotation_z, sheet
from mmradartwin_tests.third_world import rooms

SHEET_M = 0.02       # thickness of what is modelled as a sheet, where a solid is needed
CYLINDER_SIDES = 32  # faces that a cylinder's side is cast and drawn with


@dataclasses.dataclass
class Wall:
    """A flat wall: unit normal into the room [3], and offset so that normal . p = offset on it."""
    name: str
    normal: np.ndarray
    offset_m: float
    length_m: float


@dataclasses.dataclass
class KnownRoom:
    """outline: [n, 2] corners, counter-clockwise; walls[i] runs from corner i to the next. furniture: list of Actor.
    slants: bodies of the building itself, of which one slanted face bounds the room: the lower one of a roof."""
    name: str
    outline: np.ndarray
    height_m: float
    wall_names: list
    wall_tags: list
    furniture: list
    slants: list = dataclasses.field(default_factory=list)

    def solids(self):
        """All bodies in the room."""
        return self.furniture + self.slants

    def walls(self):
        """List of Wall."""
        found = []
        for i, name in enumerate(self.wall_names):
            a, b = self.outline[i], self.outline[(i + 1) % len(self.outline)]
            along = (b - a) / np.linalg.norm(b - a)
            normal = np.array([-along[1], along[0], 0.0])
            found.append(Wall(name, normal, float(normal[:2] @ a), float(np.linalg.norm(b - a))))
        return found

    def shell(self):
        """Floor, ceiling and walls as actors of one rectangle each; floor and ceiling span the outline's bounds."""
        low, high = self.outline.min(axis=0), self.outline.max(axis=0)
        w, d = high - low
        actors = [Actor("floor", "Concrete", [sheet((*low, 0), (w, 0, 0), (0, d, 0))], shell=True),
                  Actor("ceiling", "Concrete", [sheet((*low, self.height_m), (0, d, 0), (w, 0, 0))], shell=True)]
        for i, (name, tag) in enumerate(zip(self.wall_names, self.wall_tags)):
            a, b = self.outline[i], self.outline[(i + 1) % len(self.outline)]
            actors.append(Actor(name, tag, [sheet((*a, 0), (0, 0, self.height_m), (*(b - a), 0))], shell=True))
        return actors

    def actors(self):
        """Shell and bodies."""
        return self.shell() + self.solids()

    def contains(self, points, margin_m=0.0):
        """[P] whether places [P, 2 or 3] lie within the outline, at least margin_m from each wall."""
        return outline_distance(self.outline, np.atleast_2d(points)[:, :2]) > margin_m

    def clearance(self, p):
        """Distance of a point to the nearest surface, m."""
        height = min(p[2], self.height_m - p[2])
        pieces = [part.distance(p) for actor in self.solids() for part in actor.parts]
        return min([height, float(outline_distance(self.outline, np.atleast_2d(p)[:, :2])[0]), *pieces])

    def standpoints(self, rng, count, height_m=(1.3, 1.7), clearance_m=0.5):
        """[count, 3] places of a scanner, spread over the room: each is the one of 40 drawn that is farthest from those
        before it."""
        low, high = self.outline.min(axis=0), self.outline.max(axis=0)
        places = []
        while len(places) < count:
            drawn = []
            for _ in range(4000):
                p = np.array([*rng.uniform(low, high), rng.uniform(*height_m)])
                if self.contains(p, clearance_m)[0] and self.clearance(p) > clearance_m:
                    drawn.append(p)
                if len(drawn) == 40:
                    break
            if not drawn:
                clearance_m *= 0.7
                continue
            apart = [min([np.linalg.norm(p - q) for q in places], default=0.0) for p in drawn]
            places.append(drawn[int(np.argmax(apart))])
        return np.array(places)


def outline_distance(outline, points):
    """[P] signed distance of places to a polygon, positive inside, m."""
    best = np.full(len(points), np.inf)
    inside = np.zeros(len(points), bool)
    for i in range(len(outline)):
        a, b = outline[i], outline[(i + 1) % len(outline)]
        ab, ap = b - a, points - a
        t = np.clip(ap @ ab / (ab @ ab), 0, 1)
        best = np.minimum(best, np.hypot(*(ap - t[:, None] * ab).T))
        if a[1] != b[1]:
            crosses = (a[1] > points[:, 1]) != (b[1] > points[:, 1])
            x = a[0] + (points[:, 1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
            inside ^= crosses & (points[:, 0] < x)
    return np.where(inside, best, -best)


def rectangle_outline(width_m, depth_m):
    """[4, 2] corners; its walls are south, east, north, west."""
    return np.array([[0, 0], [width_m, 0], [width_m, depth_m], [0, depth_m]], float)


SIDES = ["wall_south", "wall_east", "wall_north", "wall_west"]


def office_room():
    """The office of the tests and of the shipped configuration."""
    actors = office.build_actors()
    tag = {a.name: a.tag for a in actors}
    furniture = [a for a in actors if not a.shell]
    return KnownRoom("office", rectangle_outline(office.LENGTH_M, office.WIDTH_M), office.HEIGHT_M, list(SIDES),
                     [tag[name] for name in SIDES], furniture)


def furniture_of(pieces):
    """Actors of the third world's pieces, with legs under its tables."""
    furniture = []
    for piece in pieces:
        size = piece.box.size
        turn = piece.box.axes().T
        solid = Box(piece.box.center, size, turn)
        parts = [solid]
        if piece.legs:
            bottom = piece.box.center[2] - size[2] / 2
            for sx in (-1, 1):
                for sy in (-1, 1):
                    foot = piece.box.center + turn @ [sx * (size[0] / 2 - 0.05), sy * (size[1] / 2 - 0.05), 0.0]
                    parts.append(Box(np.array([foot[0], foot[1], bottom / 2]), np.array([0.05, 0.05, bottom - 0.01]), turn))
        furniture.append(Actor(piece.name, piece.tag, parts))
    return furniture


def third_world_room(kind, seed):
    """A room of the third world (third_world/rooms.py)."""
    plan = rooms.draw_plan(np.random.default_rng([seed, 49]), kind)
    furniture = furniture_of(plan.pieces)
    return KnownRoom(f"{kind}_{seed}", rectangle_outline(*plan.size_m[:2]), float(plan.size_m[2]), list(SIDES),
                     [plan.walls[name] for name in SIDES], furniture)


def chair(name, x, y, yaw_deg):
    """Seat, back and four legs."""
    turn = rotation_z(math.radians(yaw_deg))
    at = lambda dx, dy, z: np.array([x, y, z]) + turn @ np.array([dx, dy, 0.0])
    legs = [box(at(sx * 0.19, sy * 0.19, 0.215), (0.04, 0.04, 0.42), yaw_deg) for sx in (-1, 1) for sy in (-1, 1)]
    return Actor(name, "Wood", [box(at(0, 0, 0.445), (0.44, 0.44, 0.05), yaw_deg),
                                box(at(0, 0.21, 0.70), (0.42, 0.04, 0.46), yaw_deg), *legs])


def table(name, x, y, width_m, depth_m, yaw_deg):
    """Top of 3 cm at 0.74 m, and four legs."""
    turn = rotation_z(math.radians(yaw_deg))
    at = lambda dx, dy, z: np.array([x, y, z]) + turn @ np.array([dx, dy, 0.0])
    legs = [box(at(sx * (width_m / 2 - 0.06), sy * (depth_m / 2 - 0.06), 0.36), (0.06, 0.06, 0.70), yaw_deg)
            for sx in (-1, 1) for sy in (-1, 1)]
    return Actor(name, "TableTop", [box(at(0, 0, 0.725), (width_m, depth_m, 0.03), yaw_deg), *legs])


def l_shaped_room():
    """A living room of six walls with a table, four chairs, a sofa, cupboards, a round pillar and a waste bin."""
    outline = np.array([[0, 0], [6.4, 0], [6.4, 3.1], [3.7, 3.1], [3.7, 5.2], [0, 5.2]], float)
    names = ["wall_south", "wall_east", "wall_inner_north", "wall_inner_east", "wall_north", "wall_west"]
    furniture = [
        table("table_1", 1.75, 3.65, 1.6, 0.9, 12.0),
        chair("chair_1", 1.25, 4.45, 12.0), chair("chair_2", 2.05, 4.6, 5.0),
        chair("chair_3", 1.55, 2.75, 190.0), chair("chair_4", 2.35, 2.85, 200.0),
        Actor("cabinet_1", "Metal", [box((5.9, 2.83, 0.96), (0.95, 0.5, 1.90))]),
        Actor("wardrobe_1", "Wood", [box((0.34, 1.2, 1.06), (0.6, 1.4, 2.1))]),
        Actor("sofa_1", "Carpet", [box((3.6, 0.46, 0.22), (1.9, 0.85, 0.42)), box((3.6, 0.12, 0.62), (1.9, 0.2, 0.40))]),
        Actor("door_1", "Wood", [box((6.37, 1.3, 1.03), (0.04, 0.9, 2.04))]),
        Actor("pillar_1", "Concrete", [Cylinder(np.array([4.9, 1.75, 1.30]), 0.19, 2.58)]),
        Actor("bin_1", "Plastic", [Cylinder(np.array([3.35, 4.85, 0.21]), 0.16, 0.40)])]
    return KnownRoom("l_shaped", outline, 2.6, names, ["Concrete"] * 6, furniture)


def tilted_corner_room():
    """A meeting room whose fourth wall stands at 97 degrees: not every room is rectangular."""
    outline = np.array([[0, 0], [6.0, 0], [6.5, 4.07], [0, 4.07]], float)
    furniture = [
        table("table_1", 3.0, 2.1, 2.4, 1.0, 0.0),
        chair("chair_1", 2.3, 2.95, 0.0), chair("chair_2", 3.5, 2.95, 8.0), chair("chair_3", 2.5, 1.2, 180.0),
        Actor("whiteboard_1", "Metal", [box((2.2, 4.045, 1.5), (1.8, 0.03, 1.1))]),
        Actor("cabinet_1", "Metal", [box((0.3, 3.2, 0.93), (0.45, 0.9, 1.84))]),
        Actor("cabinet_2", "Wood", [box((0.3, 1.2, 0.56), (0.45, 1.2, 1.10))]),
        Actor("door_1", "Wood", [box((1.6, 0.03, 1.03), (0.9, 0.04, 2.04))])]
    return KnownRoom("meeting_97", outline, 2.75, list(SIDES), ["Concrete"] * 4, furniture)


ROOMS = {"office": office_room, "l_shaped": l_shaped_room, "meeting_97": tilted_corner_room,
         "living_room": lambda: third_world_room("living_room", 3), "laboratory": lambda: third_world_room("laboratory", 5),
         "small_office": lambda: third_world_room("small_office", 7)}


def rectangles_of(part):
    """Rectangles of a box, a sheet or a cylinder, whose side and lids become flat pieces."""
    if not isinstance(part, Cylinder):
        return part.rectangles()
    found = []
    step = 2 * math.pi / CYLINDER_SIDES
    width = 2 * part.radius * math.tan(step / 2)
    low = part.center - [0, 0, part.height / 2]
    for k in range(CYLINDER_SIDES):
        out = np.array([math.cos(k * step), math.sin(k * step), 0.0])
        along = np.array([-out[1], out[0], 0.0])
        found.append(Rectangle(low + part.radius * out - width / 2 * along, along, np.array([0.0, 0, 1]), width,
                               part.height))
    # The lids as strips across the circle.
    edges = np.linspace(-part.radius, part.radius, 9)
    for z, sign in ((low[2], -1.0), (low[2] + part.height, 1.0)):
        for y0, y1 in zip(edges[:-1], edges[1:]):
            half = math.sqrt(max(part.radius**2 - ((y0 + y1) / 2)**2, 0.0))
            corner = np.array([part.center[0] - half, part.center[1] + y0, z])
            e1, e2 = np.array([1.0, 0, 0]), np.array([0.0, 1, 0])
            if sign < 0:
                found.append(Rectangle(corner, e2, e1, y1 - y0, 2 * half))
            else:
                found.append(Rectangle(corner, e1, e2, 2 * half, y1 - y0))
    return found
