"""Rays into a room of rectangles: what a scanner at a place sees."""
import numpy as np

from mmradartwin_tests.geometry import Rectangle
from mmradartwin_tests.scans.known_room import rectangles_of

CHUNK = 8192        # rays at a time: their tables stay in the cache


class CastRoom:
    """Arrays of all rectangles of a room. actor: [F] index into `actors`."""

    def __init__(self, room):
        self.actors = room.actors()
        flat, owner, sheets = [], [], []
        for i, actor in enumerate(self.actors):
            for part in actor.parts:
                pieces = rectangles_of(part)
                flat += pieces
                owner += [i] * len(pieces)
                sheets += [isinstance(part, Rectangle) and not actor.shell] * len(pieces)
        self.sheet = np.array(sheets)      # seen from both sides
        self.actor = np.array(owner)
        self.origin = np.array([r.origin for r in flat])
        self.e1, self.e2 = np.array([r.e1 for r in flat]), np.array([r.e2 for r in flat])
        self.s1, self.s2 = np.array([r.s1 for r in flat]), np.array([r.s2 for r in flat])
        self.normal = np.cross(self.e1, self.e2)
        self.tags = np.array([a.tag for a in self.actors])

    def cast(self, origin, directions):
        """(distance_m [P], rectangle [P]) of the first hit along unit directions [P, 3] from places [3] or [P, 3];
        inf and -1 where there is none."""
        directions = np.asarray(directions, np.float32)
        one = np.ndim(origin) == 1
        origins = np.asarray(origin, np.float32)
        distance = np.empty(len(directions), np.float32)
        which = np.empty(len(directions), np.int32)
        # From one place the back faces of bodies are never the first hit.
        facing = ((origin - self.origin) * self.normal).sum(axis=1) > 0 if one else np.ones(len(self.actor), bool)
        chosen = np.flatnonzero(facing | self.sheet)
        n, e1, e2 = (np.asarray(v[chosen], np.float32).T for v in (self.normal, self.e1, self.e2))
        on, o1, o2 = ((self.origin * v).sum(axis=1).astype(np.float32)[chosen] for v in (self.normal, self.e1, self.e2))
        s1, s2 = self.s1[chosen].astype(np.float32), self.s2[chosen].astype(np.float32)
        for begin in range(0, len(directions), CHUNK):
            rays = slice(begin, begin + CHUNK)
            d = directions[rays]
            o = origins[None] if one else origins[rays]
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (on - o @ n) / (d @ n)
                u = (o @ e1 - o1) + t * (d @ e1)
                v = (o @ e2 - o2) + t * (d @ e2)
                t[~((t > 1e-3) & (u >= 0) & (u <= s1) & (v >= 0) & (v <= s2))] = np.inf
            best = t.argmin(axis=1)
            distance[rays] = t[np.arange(len(t)), best]
            which[rays] = chosen[best]
        which[~np.isfinite(distance)] = -1
        return distance, which

    def seen(self, points, standpoints, slack_m):
        """[P] whether points [P, 3] are seen from one of the standpoints, but for slack_m before them."""
        found = np.zeros(len(points), bool)
        for place in standpoints:
            todo = np.flatnonzero(~found)
            way = points[todo] - place
            length = np.linalg.norm(way, axis=1)
            distance, _ = self.cast(place, way / length[:, None])
            found[todo[distance >= length - slack_m]] = True
        return found
