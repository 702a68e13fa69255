"""Effects of propagation that the base model leaves out."""
import copy
import math

import numpy as np

from mmradartwin_tests.coefficients import aperture_axis, fresnel
from mmradartwin_tests.diffraction import wedge
from mmradartwin_tests.effects.effect import Effect, effect
from mmradartwin_tests.geometry import Room
from mmradartwin_tests.tracing import Corner, Path, Tracer


def vertical_edges(room):
    """Edges that diffract: (start, height, n, into face 0, its normal, into face n, its normal, facets)."""
    found, shared = [], set()
    ids = [f for f in np.flatnonzero(room.reflects)]
    edges = {}
    for f in ids:
        c = room.corners(f)
        edges[f] = [tuple(sorted((tuple(np.round(c[i], 6)), tuple(np.round(c[(i + 1) % 4], 6)))))
                    for i in range(4) if abs(c[i][2] - c[(i + 1) % 4][2]) > 0.05]
    for i, a in enumerate(ids):
        if room.actors[room.actor[a]].shell:
            continue
        for b in ids[i + 1:]:
            if room.actor[a] != room.actor[b]:
                continue
            for edge in set(edges[a]) & set(edges[b]):
                shared.add((a, edge))
                shared.add((b, edge))
                if not (room.closed[a] and room.closed[b]):
                    continue
                start, end = np.array(edge[0]), np.array(edge[1])
                into = [horizontal(room.center(f) - start) for f in (a, b)]
                found.append((start, end[2] - start[2], 1.5, into[0], room.normal[a], into[1], room.normal[b],
                              (int(a), int(b))))
    for a in ids:
        if room.closed[a]:
            continue
        for edge in edges[a]:
            if (a, edge) not in shared:
                start, end = np.array(edge[0]), np.array(edge[1])
                into = horizontal(room.center(a) - start)
                found.append((start, end[2] - start[2], 2.0, into, room.normal[a], into, -room.normal[a],
                              (int(a), int(a))))
    return found


def horizontal(v):
    """Unit horizontal part of a vector."""
    v = np.array([v[0], v[1], 0.0])
    return v / np.linalg.norm(v)


@effect
class EdgeDiffraction(Effect):
    """Returns of the upright edges of furniture by UTD, wherever no first-order return of their faces holds them."""
    name, main, rank = "edge_diffraction", "level", 0
    defaults = {"level": 1.0}

    def echoes(self, measurement, station, echoes):
        if not hasattr(self, "edges"):
            self.edges = vertical_edges(measurement.room)
        room, radar, p = measurement.room, measurement.radar, station.true.position
        wavenumber = 2 * math.pi / radar.wavelength_m
        held = {path.facets[0] for path in echoes.paths if len(path.actors) == 1}
        paths = []
        for start, height, n, into_0, normal_0, into_n, normal_n, facets in self.edges:
            z = p[2] - start[2]
            ray = start[:2] - p[:2]
            distance = np.hypot(*ray)
            if held & set(facets) or not 0 <= z <= height or distance > radar.max_range_m or distance < 0.1:
                continue
            back = np.array([*(-ray / distance), 0.0])
            phi = math.atan2(normal_0 @ back, into_0 @ back) % (2 * math.pi)
            if not 0 < phi < n * math.pi:
                continue
            point = np.array([start[0], start[1], p[2]])
            if not station.true.sees(-back)[0] or not room.visible(p, point + 1e-3 * back)[0]:
                continue
            material = room.material[room.actor[facets[0]]]
            gammas = [complex(fresnel(material, max(abs(math.sin(angle)), 1e-6), radar.center_hz)[0])
                      for angle in (phi, n * math.pi - phi)]
            d = wedge(n, phi, phi, distance / 2, wavenumber, *gammas)
            factor = aperture_axis(-z, height - z, distance, distance, radar.wavelength_m)
            level = self.p["level"] * d * factor * radar.wavelength_m / (4 * math.pi) / math.sqrt(2 * distance**3)
            lengths = measurement.tracer.point_lengths(station.true, point[None])[0]
            paths.append(Path(self.name, facets[:1], (int(room.actor[facets[0]]),), point[None], -back, -back,
                              2 * float(distance), complex(level), lengths, (0.0,)))
        echoes.add(paths)


@effect
class FloorCeilingMultipath(Effect):
    """Retro paths of upright faces that stand on the floor or reach to the ceiling (within 2.5 cm), and images of third
    order with a level face among them."""
    name, main, rank = "floor_ceiling_multipath", "level", 0
    defaults = {"level": 1.0}
    REACH_M = 0.025

    def corners(self, room):
        """Corners of upright faces with floor and ceiling."""
        found = []
        for name, up in (("floor", 1.0), ("ceiling", -1.0)):
            plane = int(np.flatnonzero(room.actor == room.actor_index(name))[0])
            level = room.origin[plane][2]
            for f in np.flatnonzero(room.reflects):
                corners = room.corners(f)
                nearest = corners[:, 2].min() if up > 0 else corners[:, 2].max()
                if abs(nearest - level) > self.REACH_M or abs(room.normal[f][2]) > 1e-9:
                    continue
                foot = corners[np.abs(corners[:, 2] - nearest) < 1e-9]
                start = np.array([*foot[0][:2], level])
                along = foot[1][:2] - foot[0][:2]
                extent = float(np.hypot(*along))
                sides = [1.0] if room.closed[f] else [1.0, -1.0]
                for side in sides:
                    found.append(Corner(int(f), plane, start, np.array([*(along / extent), 0.0]), extent,
                                        np.array([0, 0, up]), side * room.normal[f]))
        return found

    def echoes(self, measurement, station, echoes):
        if not hasattr(self, "found"):
            self.found = self.corners(measurement.room)
            room = copy.copy(measurement.room)
            room.reflects = np.ones_like(room.reflects)
            self.all_faces = Tracer(room, measurement.radar)
        paths = measurement.tracer.corner_paths(station.true, self.found, self.name)
        for path in self.all_faces.images(station.true, 3):
            if not measurement.room.reflects[list(path.facets)].all():
                path.event = self.name
                paths.append(path)
        paths = [p for p in paths if p.length_m <= 2 * measurement.radar.max_range_m]
        for path in paths:
            path.coefficient *= self.p["level"]
        echoes.add(paths)


@effect
class CornerReflection(Effect):
    """An object stands so close to a wall that both form a corner, which no shared edge tells the twin."""
    name, rank = "corner_reflection", 0
    defaults = {"actors": "cabinet_north;wall_north"}
    NEAR_M = 0.06

    def names(self):
        """Both actors."""
        value = self.p["actors"]
        names = value.split(";") if isinstance(value, str) else list(value)
        if len(names) != 2:
            raise ValueError(f"corner_reflection: actors {value}: two names joined with ;")
        return names

    def corners(self, room):
        """Corners of the first actor's faces with the second's."""
        first, second = (room.actor_index(n) for n in self.names())
        found = []
        for a in np.flatnonzero((room.actor == first) & room.reflects):
            for b in np.flatnonzero((room.actor == second) & room.reflects):
                if abs(room.normal[a] @ room.normal[b]) > 1.7e-3:
                    continue
                corners = room.corners(a)
                gap = (corners - room.origin[b]) @ room.normal[b]
                if not 0 <= gap.min() <= self.NEAR_M:
                    continue
                near = corners[gap < gap.min() + 1e-9]
                foot = near - gap.min() * room.normal[b]
                foot = foot[np.argsort(foot[:, 2])]
                extent = float(foot[1][2] - foot[0][2])
                found.append(Corner(int(a), int(b), foot[0], np.array([0.0, 0.0, 1.0]), extent, room.normal[b],
                                    room.normal[a]))
        return found

    def echoes(self, measurement, station, echoes):
        if not hasattr(self, "found"):
            self.found = self.corners(measurement.room)
            if not self.found:
                raise ValueError(f"corner_reflection: {self.p['actors']} form no corner")
        echoes.add(measurement.tracer.corner_paths(station.true, self.found, self.name))

    def truth(self, measurement):
        return {"actors": self.names()}


@effect
class WallGhost(Effect):
    """Radar - wall - rough object - radar and its reverse, for the scatter points of furniture.

    gain_db: how much more than its flat scatter points an object sends sideways (rounded and small parts).
    """
    name, main, rank = "wall_ghost", "gain_db", 0
    defaults = {"walls": None, "gain_db": 12.0}
    STRIDE = 8

    def prepare(self, measurement):
        if self.p["walls"] is None:
            self.p["walls"] = str(measurement.rng(150).choice(["wall_north", "wall_south", "wall_west"]))
        for name in self.names():
            measurement.described_room.actor_index(name)

    def scale(self, strength):
        self.p["gain_db"] += 20 * math.log10(strength)

    def beside(self):
        """No edge sends anything sideways here."""
        return {"gain_db": self.p["gain_db"], "edge_level": 0.0}

    def names(self):
        """The walls."""
        value = self.p["walls"]
        return value.split(";") if isinstance(value, str) else list(value)

    def echoes(self, measurement, station, echoes):
        room, radar, tracer, p = measurement.room, measurement.radar, measurement.tracer, station.true.position
        direct = echoes.scatter
        loose = np.array([not a.shell for a in room.actors])
        pick = np.flatnonzero(loose[direct.actor])[::self.STRIDE]
        if not len(pick):
            return
        points, facet = direct.points[pick], direct.facet[pick]
        to_point = points - p
        r2 = np.linalg.norm(to_point, axis=1)
        paths = []
        for name in self.names():
            wall = int(np.flatnonzero(room.actor == room.actor_index(name))[0])
            normal, origin = room.normal[wall], room.origin[wall]
            image = p - 2 * ((p - origin) @ normal) * normal
            ray = points - image
            r1 = np.linalg.norm(ray, axis=1)
            t = ((origin - image) @ normal) / (ray @ normal)
            q = image + t[:, None] * ray
            u, v = (q - origin) @ room.e1[wall], (q - origin) @ room.e2[wall]
            good = (t > 0) & (t < 1) & (u >= 0) & (u <= room.s1[wall]) & (v >= 0) & (v <= room.s2[wall])
            out = (q - p) / np.linalg.norm(q - p, axis=1)[:, None]
            good &= station.true.sees(out) & (r1 + r2 <= 2 * radar.max_range_m)
            # The lit side of the patch must be the one that the radar sees.
            last = (points - q) / np.linalg.norm(points - q, axis=1)[:, None]
            cosine_in = -np.sum(last * room.normal[facet], axis=1)
            cosine_out = -np.sum(to_point / r2[:, None] * room.normal[facet], axis=1)
            good &= cosine_in * cosine_out > 0
            good[good] = room.visible(p, q[good]) & room.visible(q[good], points[good])
            for i in np.flatnonzero(good):
                material = room.material[room.actor[facet[i]]]
                te, _ = fresnel(material, abs(cosine_out[i]), radar.center_hz)
                wall_te, _ = fresnel(room.material[room.actor[wall]], abs(out[i] @ normal), radar.center_hz)
                area = tracer.scatter_area(facet[i]) * self.STRIDE
                level = (radar.wavelength_m / (4 * math.pi * r1[i] * r2[i]) * material.scattering * abs(te) *
                         math.sqrt(abs(cosine_in[i] * cosine_out[i]) * area / math.pi) * abs(wall_te)
                         * tracer.smooth(wall))
                # The point's own phase, the same both ways.
                value = complex(level * 10**(self.p["gain_db"] / 20) * np.exp(-1j * direct.phase[pick[i]]))
                paths += self.pair(station, tracer, wall, int(room.actor[wall]), int(direct.actor[pick[i]]), p, q[i],
                                   points[i],
                                   out[i], to_point[i] / r2[i], value)
        echoes.add(paths)

    def pair(self, station, tracer, wall, wall_actor, actor, p, q, point, out, back, value):
        """The path over the wall first and its reverse."""
        radar, room = tracer.radar, tracer.room
        n, o = room.normal[wall], room.origin[wall]
        mirror = lambda x: x - 2 * ((x - o) @ n)[:, None] * n
        tx, rx = station.true.to_map(radar.tx), station.true.to_map(radar.rx)
        distance = lambda a: np.linalg.norm(a - point, axis=1)
        first = (distance(mirror(tx))[:, None] + distance(rx)).ravel()
        second = (distance(tx)[:, None] + distance(mirror(rx))).ravel()
        length = float(np.linalg.norm(q - p) + np.linalg.norm(point - q) + np.linalg.norm(point - p))
        return [Path(self.name, (wall, -1), (wall_actor, actor), np.array([q, point]), out, back, length, value,
                     first, (0.0, 0.0)),
                Path(self.name, (-1, wall), (actor, wall_actor), np.array([point, q]), back, out, length, value,
                     second, (0.0, 0.0))]

    def truth(self, measurement):
        return {"walls": self.names()}


@effect
class Transmission(Effect):
    """Echoes from behind an actor that the twin has opaque: rays cross it, one_way_db each time."""
    name, main, rank = "transmission", "one_way_db", 0
    defaults = {"actor": "partition", "one_way_db": -3.0}

    def prepare(self, measurement):
        index = measurement.described_room.actor_index(self.p["actor"])
        self.alone = Room([measurement.described_actors[index]], measurement.described_materials)

    def room(self, measurement, actors, materials):
        for actor in actors:
            if actor.name == self.p["actor"]:
                actor.clear = True
        return actors, materials

    def crossings(self, vertices):
        """How many legs of one closed path cross the actor."""
        return int(np.sum(~self.alone.visible(vertices[:-1], vertices[1:])))

    def echoes(self, measurement, station, echoes):
        p = station.true.position
        step = 10**(self.p["one_way_db"] / 20)
        if len(echoes.paths):
            count = [self.crossings(np.concatenate([[p], path.vertices, [p]])) for path in echoes.paths]
            echoes.coefficients = echoes.coefficients * step**np.array(count)
        crossed = ~self.alone.visible(p, echoes.scatter.points)
        echoes.scatter_coefficients = echoes.scatter_coefficients * np.where(crossed, step**2, 1.0)

    def truth(self, measurement):
        return {"actor": self.p["actor"], "one_way_db": self.p["one_way_db"]}
