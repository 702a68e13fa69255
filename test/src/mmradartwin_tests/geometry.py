"""Rooms made of analytic rectangles and boxes, with occlusion tests.

All coordinates are metres in `map` (z up, floor at z = 0). Arrays of points have shape [P, 3].
"""
import dataclasses
import math

import numpy as np

GAP_M = 1e-4  # both ends of a segment are shortened by this before it is tested for occlusion


def rotation_z(yaw_rad):
    """3 x 3 rotation about z."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@dataclasses.dataclass
class Box:
    """Closed box: centre [3], edge lengths [3], rotation [3, 3] box -> map."""
    center: np.ndarray
    size: np.ndarray
    rotation: np.ndarray

    def rectangles(self):
        """The six faces, normals outward."""
        half = self.size / 2
        faces = []
        for axis in range(3):
            for sign in (-1.0, 1.0):
                a, b = (axis + 1) % 3, (axis + 2) % 3
                if sign < 0:
                    a, b = b, a
                ea, eb = self.rotation[:, a], self.rotation[:, b]
                middle = self.center + sign * half[axis] * self.rotation[:, axis]
                faces.append(Rectangle(middle - half[a] * ea - half[b] * eb, ea, eb, self.size[a], self.size[b]))
        return faces

    def distance(self, p):
        """Distance of one point to the solid box (0 inside), m."""
        q = np.abs(self.rotation.T @ (np.asarray(p) - self.center)) - self.size / 2
        return float(np.linalg.norm(np.maximum(q, 0.0)))


@dataclasses.dataclass
class Rectangle:
    """Flat two-sided sheet: corner, unit edges e1, e2 and their lengths; normal e1 x e2."""
    origin: np.ndarray
    e1: np.ndarray
    e2: np.ndarray
    s1: float
    s2: float

    def rectangles(self):
        """Itself."""
        return [self]

    def distance(self, p):
        """Distance of one point to the sheet, m."""
        d = np.asarray(p) - self.origin
        a = min(max(d @ self.e1, 0.0), self.s1)
        b = min(max(d @ self.e2, 0.0), self.s2)
        return float(np.linalg.norm(d - a * self.e1 - b * self.e2))


@dataclasses.dataclass
class Cylinder:
    """Upright closed cylinder: centre [3], radius, height. It occludes; its echoes belong to whoever adds it."""
    center: np.ndarray
    radius: float
    height: float

    def rectangles(self):
        """None: no flat face takes part."""
        return []

    def distance(self, p):
        """Distance of one point to the solid cylinder, m."""
        d = np.asarray(p) - self.center
        side = max(0.0, math.hypot(d[0], d[1]) - self.radius)
        return math.hypot(side, max(0.0, abs(d[2]) - self.height / 2))

    def blocks(self, a, delta, gap):
        """[P] True where the segment a + t delta passes through, ends shortened by gap (in t)."""
        o, d = a[:, :2] - self.center[:2], delta[:, :2]
        qa = np.maximum(np.sum(d * d, axis=1), 1e-18)
        qb, qc = np.sum(o * d, axis=1), np.sum(o * o, axis=1) - self.radius**2
        root = qb**2 - qa * qc
        size = np.sqrt(np.maximum(root, 0.0))
        dz = np.where(np.abs(delta[:, 2]) < 1e-12, 1e-12, delta[:, 2])
        z1 = (self.center[2] - self.height / 2 - a[:, 2]) / dz
        z2 = (self.center[2] + self.height / 2 - a[:, 2]) / dz
        enter = np.maximum(np.maximum((-qb - size) / qa, np.minimum(z1, z2)), gap)
        leave = np.minimum(np.minimum((-qb + size) / qa, np.maximum(z1, z2)), 1 - gap)
        return (root > 0) & (enter < leave)


@dataclasses.dataclass
class Actor:
    """A named thing of one material tag.

    shell: part of the room's convex hull, which never occludes inside it. clear: lets rays through, though it reflects.
    """
    name: str
    tag: str
    parts: list
    shell: bool = False
    clear: bool = False

    def centroid(self):
        """Mean of the corners of its parts' faces, [3]."""
        corners = [r.origin + a * r.s1 * r.e1 + b * r.s2 * r.e2 for part in self.parts for r in part.rectangles()
                   for a in (0, 1) for b in (0, 1)]
        return np.mean(corners, axis=0)

    def moved(self, rotation, translation, about=(0, 0, 0)):
        """The same thing rotated about a point and shifted."""
        about = np.asarray(about, float)
        place = lambda p: rotation @ (p - about) + about + translation
        parts = []
        for part in self.parts:
            if isinstance(part, Box):
                parts.append(Box(place(part.center), part.size, rotation @ part.rotation))
            elif isinstance(part, Cylinder):
                parts.append(Cylinder(place(part.center), part.radius, part.height))
            else:
                parts.append(Rectangle(place(part.origin), rotation @ part.e1, rotation @ part.e2, part.s1, part.s2))
        return dataclasses.replace(self, parts=parts)

    def scaled(self, factor):
        """The same thing larger by a factor about the origin."""
        parts = []
        for part in self.parts:
            if isinstance(part, Box):
                parts.append(Box(factor * part.center, factor * part.size, part.rotation))
            elif isinstance(part, Cylinder):
                parts.append(Cylinder(factor * part.center, factor * part.radius, factor * part.height))
            else:
                parts.append(Rectangle(factor * part.origin, part.e1, part.e2, factor * part.s1, factor * part.s2))
        return dataclasses.replace(self, parts=parts)


def box(center, size, yaw_deg=0.0):
    """Box by its centre and size, turned about z."""
    return Box(np.array(center, float), np.array(size, float), rotation_z(math.radians(yaw_deg)))


def sheet(origin, edge1, edge2):
    """Rectangle by a corner and two orthogonal edges."""
    edge1, edge2 = np.array(edge1, float), np.array(edge2, float)
    s1, s2 = np.linalg.norm(edge1), np.linalg.norm(edge2)
    return Rectangle(np.array(origin, float), edge1 / s1, edge2 / s2, float(s1), float(s2))


class Room:
    """Facet arrays of a list of actors, for vectorised tracing.

    origin, e1, e2, normal: [F, 3]; s1, s2: [F]; actor: [F] index into actors; closed: [F] a face of a closed box or of
    the shell, seen from its normal's side alone; reflects: [F] normal further than 45 degrees from the vertical.
    """

    def __init__(self, actors, materials):
        self.actors = list(actors)
        self.materials = materials
        names = [a.name for a in self.actors]
        if len(set(names)) != len(names):
            raise ValueError("two actors of one name")
        rectangles, owner, closed, boxes, sheets, self._cylinders = [], [], [], [], [], []
        for index, actor in enumerate(self.actors):
            for part in actor.parts:
                if not actor.clear:
                    if isinstance(part, Box):
                        boxes.append(part)
                    elif isinstance(part, Cylinder):
                        self._cylinders.append(part)
                    elif not actor.shell:
                        sheets.append(part)
                for r in part.rectangles():
                    rectangles.append(r)
                    owner.append(index)
                    closed.append(isinstance(part, Box) or actor.shell)
        self.origin = np.array([r.origin for r in rectangles])
        self.e1 = np.array([r.e1 for r in rectangles])
        self.e2 = np.array([r.e2 for r in rectangles])
        self.s1 = np.array([r.s1 for r in rectangles])
        self.s2 = np.array([r.s2 for r in rectangles])
        self.normal = np.cross(self.e1, self.e2)
        self.actor = np.array(owner)
        self.closed = np.array(closed)
        self.reflects = np.abs(self.normal[:, 2]) <= math.cos(math.radians(45.0))
        self.material = [materials[a.tag] for a in self.actors]
        self._box_center = np.array([b.center for b in boxes]).reshape(-1, 3)
        self._box_rotation = np.array([b.rotation for b in boxes]).reshape(-1, 3, 3)
        self._box_half = np.array([b.size / 2 for b in boxes]).reshape(-1, 3)
        self._sheets = sheets

    def actor_index(self, name):
        """Index of a named actor; ValueError where absent."""
        for i, actor in enumerate(self.actors):
            if actor.name == name:
                return i
        raise ValueError(f"no actor '{name}' in the room; actors: {', '.join(a.name for a in self.actors)}")

    def corners(self, f):
        """[4, 3] corners of facet f."""
        a, b = self.s1[f] * self.e1[f], self.s2[f] * self.e2[f]
        return np.array([self.origin[f], self.origin[f] + a, self.origin[f] + a + b, self.origin[f] + b])

    def center(self, f):
        """Middle of facet f."""
        return self.origin[f] + self.s1[f] / 2 * self.e1[f] + self.s2[f] / 2 * self.e2[f]

    def inside(self, p):
        """Name of the actor whose box holds point p, or None."""
        for actor in self.actors:
            for part in actor.parts:
                if isinstance(part, Box):
                    q = np.abs(part.rotation.T @ (np.asarray(p) - part.center))
                    if np.all(q < part.size / 2):
                        return actor.name
        return None

    def clearance(self, p):
        """Distance from p to the nearest surface of anything, m."""
        return min(part.distance(p) for actor in self.actors for part in actor.parts)

    def visible(self, a, b):
        """[P] True where the open segment a-b meets no box and no sheet. a, b: [P, 3] or [3]."""
        a, b = np.atleast_2d(a), np.atleast_2d(b)
        a, b = np.broadcast_arrays(a, b)
        free = np.ones(len(a), bool)
        delta = b - a
        length = np.linalg.norm(delta, axis=1)
        gap = GAP_M / np.maximum(length, 1e-9)
        for center, rotation, half in zip(self._box_center, self._box_rotation, self._box_half):
            todo = np.flatnonzero(free)
            if not len(todo):
                return free
            o = (a[todo] - center) @ rotation
            d = delta[todo] @ rotation
            d = np.where(np.abs(d) < 1e-12, 1e-12, d)
            t1, t2 = (-half - o) / d, (half - o) / d
            enter = np.maximum(np.minimum(t1, t2).max(axis=1), gap[todo])
            leave = np.minimum(np.maximum(t1, t2).min(axis=1), 1 - gap[todo])
            free[todo[enter < leave]] = False
        for cylinder in self._cylinders:
            todo = np.flatnonzero(free)
            free[todo[cylinder.blocks(a[todo], delta[todo], gap[todo])]] = False
        for r in self._sheets:
            todo = np.flatnonzero(free)
            n = np.cross(r.e1, r.e2)
            d = delta[todo] @ n
            with np.errstate(divide="ignore", invalid="ignore"):
                t = ((r.origin - a[todo]) @ n) / d
                q = a[todo] + t[:, None] * delta[todo] - r.origin
                u, v = q @ r.e1, q @ r.e2
                hit = (t > gap[todo]) & (t < 1 - gap[todo]) & (u >= 0) & (u <= r.s1) & (v >= 0) & (v <= r.s2)
            free[todo[hit]] = False
        return free
