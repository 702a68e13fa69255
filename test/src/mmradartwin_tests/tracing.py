"""Paths of the base model by images of analytic rectangles: specular up to order 3, corners, diffuse scatter points.

Choices where the model's text leaves room, each the most literal reading:
- The first-order rule beside a facet: level (Fresnel coefficient included) is that of the perpendicular ray, normal
  incidence and s = 2R; delay, direction, field of view and visibility are those of the nearest point 1 cm inside.
- "Across the ray" at oblique reflections: a facet's half extent along its edge e is foreshortened by sqrt(1 - (e.k)^2),
  k the direction of incidence; the two edges are treated separately.
- The vertical antenna's field is the unit vector along radar z made transverse to the ray (no pattern in it).
- |Gamma| of a scatter patch: the vertical field is resolved into TE and TM there and the powers are added.
- Inside tests of higher orders have no tolerance; a corner's pair of faces takes no part at order 2.
- Visibility is tested from radar_link's origin, where transmitter 0 and receiver 0 stand.
"""
import dataclasses
import math
import zlib

import numpy as np

from mmradartwin_tests.coefficients import aperture_axis, fresnel, reflect_field, transverse_vertical

MAX_ELEVATION_SINE = math.sin(math.radians(20.0))
INSET_M = 0.01
MIN_FACTOR = 0.01


@dataclasses.dataclass
class Path:
    """One path. Coefficient in the exp(-jkL) convention with spreading; lengths per virtual element."""
    event: str
    facets: tuple
    actors: tuple
    vertices: np.ndarray      # [n, 3] map
    departure: np.ndarray     # unit, map, from the radar
    arrival: np.ndarray       # unit, map, from the radar
    length_m: float           # at radar_link's origin
    coefficient: complex
    lengths_m: np.ndarray     # [M]
    cosines: tuple            # of incidence, per interaction


@dataclasses.dataclass
class Scatter:
    """Scatter points seen from one pose: lengths [P, M]; amplitude, phase, facet, actor [P]; points [P, 3]."""
    points: np.ndarray
    lengths_m: np.ndarray
    amplitude: np.ndarray
    phase: np.ndarray
    facet: np.ndarray
    actor: np.ndarray


@dataclasses.dataclass
class Corner:
    """Two facets a, b that meet at a right angle: edge from start along a unit vector, directions from it."""
    a: int
    b: int
    start: np.ndarray
    along: np.ndarray
    extent_m: float
    into_a: np.ndarray
    into_b: np.ndarray


class Pose:
    """Radar in map: position [3] and rotation [3, 3] (radar_link -> map)."""

    def __init__(self, position, rotation):
        self.position = np.asarray(position, float)
        self.rotation = np.asarray(rotation, float)

    def to_map(self, points):
        """Radar coordinates [.., 3] -> map."""
        return np.asarray(points) @ self.rotation.T + self.position

    def to_radar(self, directions):
        """Directions [.., 3] in map -> radar_link."""
        return np.asarray(directions) @ self.rotation

    def sees(self, directions):
        """Within the base field of view; directions [P, 3] in map, unit."""
        d = self.to_radar(np.atleast_2d(directions))
        return (d[:, 0] > 0) & (np.abs(d[:, 2]) <= MAX_ELEVATION_SINE)


def find_corners(room):
    """Pairs of reflecting facets that share an edge at a concave 90 degrees: list of Corner."""
    found = []
    reflecting = np.flatnonzero(room.reflects)
    edges = {}
    for f in reflecting:
        c = room.corners(f)
        edges[f] = [(c[i], c[(i + 1) % 4]) for i in range(4)]
    for i, a in enumerate(reflecting):
        for b in reflecting[i + 1:]:
            if abs(room.normal[a] @ room.normal[b]) > math.sin(math.radians(0.1)):
                continue
            ia, ib = room.center(a) - room.origin[b], room.center(b) - room.origin[a]
            if room.closed[a] and ib @ room.normal[a] <= 0 or room.closed[b] and ia @ room.normal[b] <= 0:
                continue
            for p0, p1 in edges[a]:
                along = p1 - p0
                length = np.linalg.norm(along)
                along = along / length
                for q0, q1 in edges[b]:
                    t0, t1 = (q0 - p0) @ along, (q1 - p0) @ along
                    if max(np.linalg.norm(q0 - p0 - t0 * along), np.linalg.norm(q1 - p0 - t1 * along)) > 1e-3:
                        continue
                    low, high = max(0.0, min(t0, t1)), min(length, max(t0, t1))
                    if high - low > 1e-3:
                        start = p0 + low * along
                        into = []
                        for f in (a, b):
                            v = room.center(f) - start
                            v = v - (v @ along) * along
                            into.append(v / np.linalg.norm(v))
                        found.append(Corner(int(a), int(b), start, along, high - low, *into))
    return found


class Tracer:
    """Traces one room with one radar. Everything that no pose changes is prepared once."""

    def __init__(self, room, radar, scatter_density_per_m2=600.0, speckle_seed=0, max_order=3):
        self.room, self.radar, self.max_order = room, radar, max_order
        self.corners = find_corners(room)
        corner_pairs = {(c.a, c.b) for c in self.corners} | {(c.b, c.a) for c in self.corners}
        ids = np.flatnonzero(room.reflects)
        corner_points = np.array([room.corners(f) for f in range(len(room.s1))])
        # heights[f, g]: how far facet g reaches to the front of facet f
        level = np.sum(room.normal * room.origin, axis=1)
        heights = np.einsum("gcx,fx->fgc", corner_points, room.normal) - level[:, None, None]
        reach = np.where(room.closed[:, None], heights.max(axis=2), np.abs(heights).max(axis=2)) > 1e-6
        faces = reach & reach.T
        self._faces = np.zeros_like(faces)
        self._faces[np.ix_(ids, ids)] = faces[np.ix_(ids, ids)]
        np.fill_diagonal(self._faces, False)
        self._is_corner = np.zeros_like(faces)
        for a, b in corner_pairs:
            self._is_corner[a, b] = True
        self._scatter_settings = (scatter_density_per_m2, speckle_seed)
        self._scatter_points = None

    def _prepare_scatter(self):
        room, (density, seed) = self.room, self._scatter_settings
        points, area, facet, phase = [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0, int)], [np.zeros(0)]
        first = {a: f for f, a in reversed(list(enumerate(room.actor)))}
        for f in np.flatnonzero(room.reflects):
            if not room.material[room.actor[f]].scattering:
                continue
            n1 = max(1, int(math.ceil(room.s1[f] * math.sqrt(density))))
            n2 = max(1, int(math.ceil(room.s2[f] * math.sqrt(density))))
            # Keyed by name and place in the actor, so that adding or removing others changes nothing here.
            key = [zlib.crc32(room.actors[room.actor[f]].name.encode()), int(f - first[room.actor[f]])]
            rng = np.random.default_rng([20, *key])
            i, j = np.meshgrid(np.arange(n1), np.arange(n2), indexing="ij")
            u = (i.ravel() + rng.random(n1 * n2)) / n1 * room.s1[f]
            v = (j.ravel() + rng.random(n1 * n2)) / n2 * room.s2[f]
            points.append(room.origin[f] + u[:, None] * room.e1[f] + v[:, None] * room.e2[f])
            area.append(np.full(n1 * n2, room.s1[f] * room.s2[f] / (n1 * n2)))
            facet.append(np.full(n1 * n2, f))
            phase.append(np.random.default_rng([21, seed, *key]).uniform(0, 2 * np.pi, n1 * n2))
        self._scatter_points, self._scatter_area = np.concatenate(points), np.concatenate(area)
        self._scatter_facet, self._scatter_phase = np.concatenate(facet), np.concatenate(phase)

    def specular(self, pose):
        """All paths of the mechanisms specular and corner from one pose."""
        paths = self._first_order(pose) + self.corner_paths(pose, self.corners)
        for order in range(2, self.max_order + 1):
            paths += self.images(pose, order)
        limit = 2 * self.radar.max_range_m
        return [p for p in paths if p.length_m <= limit]

    def point_lengths(self, pose, points):
        """[P, M] path lengths TX - point - RX."""
        tx, rx = pose.to_map(self.radar.tx), pose.to_map(self.radar.rx)
        out = np.linalg.norm(points[:, None, :] - tx, axis=2)
        back = np.linalg.norm(points[:, None, :] - rx, axis=2)
        return (out[:, :, None] + back[:, None, :]).reshape(len(points), self.radar.channels)

    def image_lengths(self, pose, facets):
        """[M] path lengths by images of each transmitter over the facets in order."""
        tx, rx = pose.to_map(self.radar.tx), pose.to_map(self.radar.rx)
        for f in facets:
            n = self.room.normal[f]
            tx = tx - 2 * ((tx - self.room.origin[f]) @ n)[:, None] * n
        return np.linalg.norm(tx[:, None, :] - rx, axis=2).reshape(-1)

    def smooth(self, f):
        """sqrt(1 - S^2) of facet f."""
        return math.sqrt(1 - self.room.material[self.room.actor[f]].scattering**2)

    def _polarised(self, pose, directions, facets):
        """Product of Fresnel coefficients (copolar, vertical antenna) of a ray with the given leg directions."""
        up = pose.rotation[:, 2]
        field = transverse_vertical(directions[0], up).astype(complex)
        cosines = []
        for k_in, f in zip(directions[:-1], facets):
            field, _, cosine = reflect_field(field, k_in, self.room.normal[f], self.room.material[self.room.actor[f]],
                                             self.radar.center_hz)
            cosines.append(float(cosine))
        return field @ transverse_vertical(-directions[-1], up), tuple(cosines)

    def _first_order(self, pose):
        room, wavelength = self.room, self.radar.wavelength_m
        p = pose.position
        ids = np.flatnonzero(room.reflects)
        height = np.sum((p - room.origin[ids]) * room.normal[ids], axis=1)
        ids, height = ids[(height > 1e-6) | (~room.closed[ids] & (np.abs(height) > 1e-6))], height[
            (height > 1e-6) | (~room.closed[ids] & (np.abs(height) > 1e-6))]
        distance = np.abs(height)
        u = np.sum((p - room.origin[ids]) * room.e1[ids], axis=1)
        v = np.sum((p - room.origin[ids]) * room.e2[ids], axis=1)
        factor = (aperture_axis(-u, room.s1[ids] - u, distance, distance, wavelength) *
                  aperture_axis(-v, room.s2[ids] - v, distance, distance, wavelength))
        inside = (u >= 0) & (u <= room.s1[ids]) & (v >= 0) & (v <= room.s2[ids])
        clamp = lambda x, size: np.clip(x, np.minimum(INSET_M, size / 2), np.maximum(size - INSET_M, size / 2))
        un, vn = np.where(inside, u, clamp(u, room.s1[ids])), np.where(inside, v, clamp(v, room.s2[ids]))
        target = room.origin[ids] + un[:, None] * room.e1[ids] + vn[:, None] * room.e2[ids]
        ray = target - p
        length = np.linalg.norm(ray, axis=1)
        direction = ray / length[:, None]
        keep = (np.abs(factor) >= MIN_FACTOR) & pose.sees(direction) & (length <= self.radar.max_range_m)
        keep[keep] = room.visible(p, target[keep])
        paths = []
        for i in np.flatnonzero(keep):
            f = int(ids[i])
            # The perpendicular's level, also beside the facet.
            perpendicular = -math.copysign(1.0, height[i]) * room.normal[f]
            gamma, _ = self._polarised(pose, [perpendicular, -perpendicular], [f])
            coefficient = gamma * self.smooth(f) * factor[i] * wavelength / (4 * np.pi * 2 * distance[i])
            lengths = self.image_lengths(pose, [f]) if inside[i] else self.point_lengths(pose, target[i:i + 1])[0]
            paths.append(Path("specular", (f,), (int(room.actor[f]),), target[i:i + 1], direction[i], direction[i],
                              float(2 * length[i]), complex(coefficient), lengths, (1.0,)))
        return paths

    def corner_paths(self, pose, corners, event="corner"):
        """Retro paths of Corners seen from one pose."""
        room, wavelength, p = self.room, self.radar.wavelength_m, pose.position
        paths = []
        for corner in corners:
            a, b, start, along, extent = corner.a, corner.b, corner.start, corner.along, corner.extent_m
            into_a, into_b = corner.into_a, corner.into_b
            t = (p - start) @ along
            foot = start + t * along
            distance = np.linalg.norm(foot - p)
            perpendicular = (foot - p) / distance
            # On the side of both faces where the other one lies.
            if (p - start) @ into_a <= 1e-6 or (p - start) @ into_b <= 1e-6:
                continue
            across = np.cross(along, perpendicular)
            far = sorted(max((room.corners(f) - start) @ into) * (into @ across)
                         for f, into in ((a, into_a), (b, into_b)))
            factor = (aperture_axis(far[0], far[1], distance, distance, wavelength) *
                      aperture_axis(-t, extent - t, distance, distance, wavelength))
            inside = 0 <= t <= extent
            nearest = t if inside else min(max(t, min(INSET_M, extent / 2)), max(extent - INSET_M, extent / 2))
            target = start + nearest * along
            length = np.linalg.norm(target - p)
            direction = (target - p) / length
            # A point just before the edge: the edge itself lies on both faces.
            probe = target + 1e-4 * (into_a + into_b)
            if abs(factor) < MIN_FACTOR or not pose.sees(direction)[0] or not room.visible(p, probe)[0]:
                continue
            between = perpendicular - 2 * (perpendicular @ room.normal[a]) * room.normal[a]
            gamma, cosines = self._polarised(pose, [perpendicular, between, -perpendicular], [a, b])
            coefficient = gamma * self.smooth(a) * self.smooth(b) * factor * wavelength / (4 * np.pi * 2 * distance)
            lengths = self.image_lengths(pose, [a, b]) if inside else self.point_lengths(pose, target[None])[0]
            paths.append(Path(event, (a, b), (int(room.actor[a]), int(room.actor[b])), np.array([target, target]),
                              direction, direction, float(2 * length), complex(coefficient), lengths, cosines))
        return paths

    def _sequences(self, pose, order):
        """[S, order] facet sequences whose first and last facet face the radar."""
        room, p = self.room, pose.position
        height = np.sum((p - room.origin) * room.normal, axis=1)
        front = room.reflects & ((height > 1e-6) | (~room.closed & (np.abs(height) > 1e-6)))
        first = np.flatnonzero(front)
        if order == 2:
            i, j = np.nonzero(self._faces[np.ix_(first, first)] & ~self._is_corner[np.ix_(first, first)])
            return np.stack([first[i], first[j]], axis=1)
        i, j = np.nonzero(self._faces[first])
        pairs = np.stack([first[i], j], axis=1)
        last = self._faces[pairs[:, 1]] & front
        row, k = np.nonzero(last)
        return np.concatenate([pairs[row], k[:, None]], axis=1)

    def images(self, pose, order):
        """Paths over the images of second or third order, those of corners left out."""
        room, p, wavelength = self.room, pose.position, self.radar.wavelength_m
        if order > 3:
            raise ValueError("images are searched up to order 3")
        sequences = self._sequences(pose, order)
        image = np.broadcast_to(p, (len(sequences), 3))
        images = []
        for i in range(order):
            f = sequences[:, i]
            n = room.normal[f]
            image = image - 2 * np.sum((image - room.origin[f]) * n, axis=1)[:, None] * n
            images.append(image)
        alive = np.flatnonzero(np.linalg.norm(image - p, axis=1) <= 2 * self.radar.max_range_m)
        target = np.broadcast_to(p, (len(alive), 3))
        points = np.zeros((len(sequences), order, 3))
        for i in range(order - 1, -1, -1):
            f = sequences[alive, i]
            step = images[i][alive] - target
            with np.errstate(divide="ignore", invalid="ignore"):
                t = np.sum((room.origin[f] - target) * room.normal[f], axis=1) / np.sum(step * room.normal[f], axis=1)
                q = target + t[:, None] * step
                u = np.sum((q - room.origin[f]) * room.e1[f], axis=1)
                v = np.sum((q - room.origin[f]) * room.e2[f], axis=1)
                good = (t > 1e-9) & (t < 1 - 1e-9) & (u >= 0) & (u <= room.s1[f]) & (v >= 0) & (v <= room.s2[f])
            if i == order - 1 or i == 0:
                ray = q - p
                with np.errstate(invalid="ignore", divide="ignore"):
                    good &= pose.sees(ray / np.linalg.norm(ray, axis=1)[:, None])
            alive, target = alive[good], q[good]
            points[alive, i] = target
        if not len(alive):
            return []
        chain = np.concatenate([np.broadcast_to(p, (len(alive), 1, 3)), points[alive],
                                np.broadcast_to(p, (len(alive), 1, 3))], axis=1)
        free = room.visible(chain[:, :-1].reshape(-1, 3), chain[:, 1:].reshape(-1, 3))
        free = free.reshape(len(alive), order + 1).all(axis=1)
        paths, seen = [], set()
        for row, vertices in zip(alive[free], chain[free]):
            facets = [int(f) for f in sequences[row]]
            key = (tuple(sorted(facets)), tuple(np.round(images[-1][row], 6)))
            if key in seen:
                continue
            seen.add(key)
            legs = np.diff(vertices, axis=0)
            size = np.linalg.norm(legs, axis=1)
            total = size.sum()
            directions = legs / size[:, None]
            gamma, cosines = self._polarised(pose, list(directions), facets)
            factor, before = 1.0 + 0j, 0.0
            for i, f in enumerate(facets):
                before += size[i]
                d = vertices[i + 1] - room.origin[f]
                for edge, extent in ((room.e1[f], room.s1[f]), (room.e2[f], room.s2[f])):
                    narrow = math.sqrt(max(0.0, 1 - (edge @ directions[i])**2))
                    x = d @ edge
                    factor *= aperture_axis(-x * narrow, (extent - x) * narrow, before, total - before, wavelength)
                factor *= self.smooth(f)
            coefficient = gamma * factor * wavelength / (4 * np.pi * total)
            paths.append(Path("specular", tuple(facets), tuple(int(room.actor[f]) for f in facets), vertices[1:-1],
                              directions[0], -directions[-1], float(total), complex(coefficient),
                              self.image_lengths(pose, facets), cosines))
        return paths

    def scatter_area(self, f):
        """Area per scatter point of facet f, m^2."""
        return float(self._scatter_area[np.searchsorted(self._scatter_facet, f)])

    def diffuse(self, pose):
        """Scatter points seen from one pose."""
        if self._scatter_points is None:
            self._prepare_scatter()
        room, wavelength, p = self.room, self.radar.wavelength_m, pose.position
        ray = self._scatter_points - p
        r = np.linalg.norm(ray, axis=1)
        direction = ray / np.maximum(r, 1e-9)[:, None]
        cosine = -np.sum(direction * room.normal[self._scatter_facet], axis=1)
        keep = pose.sees(direction) if len(r) else np.zeros(0, bool)
        lit = (cosine > 1e-6) | (~room.closed[self._scatter_facet] & (np.abs(cosine) > 1e-6))
        keep &= (r <= self.radar.max_range_m) & lit
        keep[keep] = room.visible(p, self._scatter_points[keep])
        facet, direction, r = self._scatter_facet[keep], direction[keep], r[keep]
        cosine = np.abs(cosine[keep])
        actor = room.actor[facet]
        # Vertical polarisation resolved at the patch.
        up = pose.rotation[:, 2]
        vertical = up - (direction @ up)[:, None] * direction
        vertical /= np.linalg.norm(vertical, axis=1)[:, None]
        te_axis = np.cross(direction, room.normal[facet])
        size = np.linalg.norm(te_axis, axis=1)
        te_share = np.where(size > 1e-9, np.sum(te_axis * vertical, axis=1)**2 / np.maximum(size, 1e-12)**2, 1.0)
        gamma, scattering = np.zeros(len(r)), np.zeros(len(r))
        for a in np.unique(actor):
            m = actor == a
            te, tm = fresnel(room.material[a], cosine[m], self.radar.center_hz)
            gamma[m] = np.sqrt(np.abs(te)**2 * te_share[m] + np.abs(tm)**2 * (1 - te_share[m]))
            scattering[m] = room.material[a].scattering
        patch = np.sqrt(self._scatter_area[keep] / np.pi)
        amplitude = wavelength / (4 * np.pi * r**2) * scattering * gamma * cosine * patch
        points = self._scatter_points[keep]
        return Scatter(points, self.point_lengths(pose, points), amplitude, self._scatter_phase[keep], facet, actor)


def path_arrays(paths, channels):
    """Lengths [P, M] and coefficients [P] (conjugated into the radar's convention) of a list of paths."""
    if not paths:
        return np.zeros((0, channels)), np.zeros(0, complex)
    return np.array([p.lengths_m for p in paths]), np.conj(np.array([p.coefficient for p in paths]))
