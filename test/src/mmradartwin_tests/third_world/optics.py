"""Echoes of a room by physical optics: every visible patch of every face adds a wave, glints come out of the sum.

First order: all patches of all faces. Higher orders: on the smallest face of a sequence patches around the point of
reflection, on the others mirror reflection with the height and reflectivity found there. Shadows are hard.
"""
import itertools
import math

import numpy as np

from mmradartwin_tests.third_world.surfaces import BLOCK, reflection, strip_sum, visible

STEP_M = 0.002          # of the delay axis, way there and back
LONGEST_M = 20.2
WINDOW_M = (0.28, 0.5)  # around a point of reflection of higher order: all of it, nothing beyond
MARGIN_M = 0.25         # a point of reflection may lie so far beside its face
MAX_ORDER = 3


class Wire:
    """Points along thin upright or slack things; amplitude [P] is the root of each point's echo area, m."""

    def __init__(self, points, amplitude):
        self.points, self.amplitude = np.asarray(points, float), np.asarray(amplitude, complex)


class World:
    """Faces, boxes and small things as one radar front sees them."""

    def __init__(self, faces, boxes, wires, front):
        self.faces, self.boxes, self.front = faces, boxes, front
        self._join_patches()
        self.small = np.concatenate([w.points for w in wires] or [np.zeros((0, 3))])
        self.small_amplitude = np.concatenate([w.amplitude for w in wires] or [np.zeros(0, complex)])
        self.origin, self.normal = np.array([f.origin for f in faces]), np.array([f.normal for f in faces])
        self.e1, self.e2 = np.array([f.e1 for f in faces]), np.array([f.e2 for f in faces])
        self.size = np.array([[f.s1, f.s2] for f in faces])
        corners = np.array([[f.origin + a * f.s1 * f.e1 + b * f.s2 * f.e2 for a in (0, 1) for b in (0, 1)]
                            for f in faces])
        height = np.einsum("gcx,fx->fgc", corners, self.normal) - np.sum(self.normal * self.origin, axis=1)[:, None,
                                                                                                           None]
        reach = height.max(axis=2) > 1e-3
        self.faced = reach & reach.T
        np.fill_diagonal(self.faced, False)

    def _join_patches(self):
        """Arrays over the patches of all faces."""
        points, face, level, height, scatter, block, centers, count = [], [], [], [], [], [], [], 0
        for index, f in enumerate(self.faces):
            points.append(f.points().reshape(-1, 3))
            face.append(np.full(f.shape[0] * f.shape[1], index))
            level.append(f.level_db.ravel())
            height.append(f.height.ravel())
            scatter.append(f.scatter.ravel())
            b1, b2 = -(-f.shape[0] // BLOCK), -(-f.shape[1] // BLOCK)
            block.append((count + np.arange(f.shape[0])[:, None] // BLOCK * b2 +
                          np.arange(f.shape[1]) // BLOCK).ravel())
            u = f.u[np.minimum(np.arange(b1) * BLOCK + BLOCK // 2, f.shape[0] - 1)]
            v = f.v[np.minimum(np.arange(b2) * BLOCK + BLOCK // 2, f.shape[1] - 1)]
            centers.append((f.origin + u[:, None, None] * f.e1 + v[:, None] * f.e2).reshape(-1, 3))
            count += b1 * b2
        self.patch, self.patch_face = np.concatenate(points), np.concatenate(face)
        self.patch_level = 10**(np.concatenate(level) / 20)
        self.patch_height, self.patch_scatter = np.concatenate(height), np.concatenate(scatter)
        self.patch_block, self.block_center = np.concatenate(block), np.concatenate(centers)
        self.patch_size = np.concatenate([np.stack(np.meshgrid(f.d1, f.d2, indexing="ij"), axis=-1).reshape(-1, 2)
                                          for f in self.faces])

    def profile(self, position, rotation):
        """[M, L] complex echo over the delay axis of one pose; the rotation takes radar axes into map."""
        found = self._stand(position, rotation)
        self._first_order(found)
        self._small_things(found)
        for order in range(2, MAX_ORDER + 1):
            for sequence, stationary in self._sequences(order):
                self._higher_order(found, sequence, stationary)
        return found

    def _stand(self, position, rotation):
        """Takes the radar to a pose. [M, L] zeros for its echo."""
        self.rotation = np.asarray(rotation, float)
        self.tx = np.asarray(position, float) + self.front.tx @ self.rotation.T
        self.rx = np.asarray(position, float) + self.front.rx @ self.rotation.T
        self.position = (self.tx.mean(axis=0) + self.rx.mean(axis=0)) / 2     # the array's middle
        return np.zeros((8, int(LONGEST_M / STEP_M) + 2), complex)

    def corner(self, position, rotation, first, second):
        """Largest amplitude of a channel over the delay axis by the ways over one face of each of two sets of faces."""
        found = self._stand(position, rotation)
        for sequence, stationary in self._sequences(2):
            ends = {int(f) for f in sequence}
            if ends & first and ends & second:
                self._higher_order(found, sequence, stationary)
        return float(np.abs(found).max())

    def _add(self, found, tx_m, rx_m, gains_out, gains_back, weight, shorter_m=0.0):
        """Adds waves: legs [2, P] and [4, P], element gains, weights [P] before spreading."""
        for t, r in itertools.product(range(2), range(4)):
            length = tx_m[t] + rx_m[r] - shorter_m
            c = weight * gains_out[t] * gains_back[2 + r] / (tx_m[t] * rx_m[r]) * self.front.phase(length)
            place = length / STEP_M
            cell = place.astype(int)
            part = place - cell
            keep = cell < found.shape[1] - 1
            for shift, share in ((0, 1 - part), (1, part)):
                w, at = (c * share)[keep], cell[keep] + shift
                found[4 * t + r].real += np.bincount(at, w.real, found.shape[1])
                found[4 * t + r].imag += np.bincount(at, w.imag, found.shape[1])

    def _adding_area(self, index, size, ways, nearness):
        """Area of patches [P, 2] of faces [P] as it adds up; ways: direction there plus direction back [P, 3], nearness:
        sum of both 1 / leg."""
        k, area = 2 * np.pi / self.front.wavelength_m, 1.0
        for axis, edges in enumerate((self.e1[index], self.e2[index])):
            slope = np.sum(ways * edges, axis=1)
            area = area * strip_sum(size[:, axis], k * slope, k / 2 * (1 - (slope / 2)**2) * nearness)
        return area

    def _gamma(self, index, cosine):
        """Reflection coefficients at faces [P]."""
        gamma = np.empty(len(index), complex)
        for matter in {id(f.matter): f.matter for f in self.faces}.values():
            mine = np.array([f.matter is matter for f in self.faces])[index]
            gamma[mine] = reflection(matter, cosine[mine])
        return gamma

    def _first_order(self, found):
        seen = np.zeros(len(self.block_center), bool)
        ray = (self.block_center - self.position) @ self.rotation
        distance = np.linalg.norm(ray, axis=1)
        ahead = np.flatnonzero((ray[:, 0] > -0.1) & (np.abs(ray[:, 2]) < 0.5 * distance) & (distance < 10.3))
        seen[ahead] = visible(self.boxes, self.position, self.block_center[ahead])
        use = np.flatnonzero(seen[self.patch_block])
        index = self.patch_face[use]
        ray = self.patch[use] - self.position
        distance = np.linalg.norm(ray, axis=1)
        ray /= distance[:, None]
        cosine = -np.sum(ray * self.normal[index], axis=1)
        local = ray @ self.rotation
        keep = (cosine > 1e-3) & (local[:, 0] > 0) & (np.abs(local[:, 2]) < 0.41)
        use, index, ray, cosine, local, distance = (a[keep] for a in (use, index, ray, cosine, local, distance))
        scattering = np.array([f.matter.scattering for f in self.faces])[index]
        gamma, size = self._gamma(index, cosine) * self.patch_level[use], self.patch_size[use]
        weight = (-1j / (4 * math.pi) * cosine * self._adding_area(index, size, 2 * ray, 2 / distance) * gamma *
                  np.sqrt(1 - scattering**2))
        area = size[:, 0] * size[:, 1]
        weight += (self.front.wavelength_m / (4 * math.pi)**1.5 * self.patch_scatter[use] * np.abs(gamma) *
                   scattering * 2 * cosine * np.sqrt(area))
        gains = self.front.gains(local)
        points = self.patch[use]
        self._add(found, [np.linalg.norm(points - e, axis=1) for e in self.tx],
                  [np.linalg.norm(points - e, axis=1) for e in self.rx], gains, gains, weight,
                  2 * cosine * self.patch_height[use])

    def _small_things(self, found):
        ray = self.small - self.position
        distance = np.linalg.norm(ray, axis=1)
        local = ray @ self.rotation / distance[:, None]
        use = np.flatnonzero((local[:, 0] > 0) & (np.abs(local[:, 2]) < 0.41) & (distance > 0.25) & (distance < 10.1))
        use = use[visible(self.boxes, self.position, self.small[use], 0.02)]
        points, gains = self.small[use], self.front.gains(local[use])
        weight = self.front.wavelength_m / (4 * math.pi)**1.5 * self.small_amplitude[use]
        self._add(found, [np.linalg.norm(points - e, axis=1) for e in self.tx],
                  [np.linalg.norm(points - e, axis=1) for e in self.rx], gains, gains, weight)

    def _mirror(self, points, f):
        return points - 2 * np.sum((points - self.origin[f]) * self.normal[f], axis=-1)[..., None] * self.normal[f]

    def _sequences(self, order):
        """(faces, points of reflection) of the closed ways over `order` faces, each point on its face or near it."""
        front = np.flatnonzero(np.sum((self.position - self.origin) * self.normal, axis=1) > 1e-3)
        at = front[:, None]
        for _ in range(order - 1):
            row, following = np.nonzero(self.faced[at[:, -1]])
            at = np.concatenate([at[row], following[:, None]], axis=1)
        at = at[np.isin(at[:, -1], front)]
        images = [np.broadcast_to(self.position, (len(at), 3))]
        for m in range(order):
            images.append(self._mirror(images[-1], at[:, m]))
        good = np.linalg.norm(images[-1] - self.position, axis=1) < LONGEST_M - 0.2
        points = np.zeros((len(at), order, 3))
        target = np.broadcast_to(self.position, (len(at), 3))
        for m in reversed(range(order)):
            f = at[:, m]
            way = target - images[m + 1]
            normal, origin = self.normal[f], self.origin[f]
            down = np.sum(way * normal, axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                share = np.sum((origin - images[m + 1]) * normal, axis=1) / down
            share = np.where(np.isfinite(share), share, -1.0)
            target = images[m + 1] + share[:, None] * way
            u, v = np.sum((target - origin) * self.e1[f], axis=1), np.sum((target - origin) * self.e2[f], axis=1)
            good &= (share > -1e-6) & (share < 1 + 1e-6) & (u > -MARGIN_M) & (u < self.size[f, 0] + MARGIN_M)
            good &= (v > -MARGIN_M) & (v < self.size[f, 1] + MARGIN_M)
            points[:, m] = target
        for end in (0, order - 1):
            way = (points[:, end] - self.position) @ self.rotation
            good &= (way[:, 0] > 0) & (np.abs(way[:, 2]) < 0.45 * np.linalg.norm(way, axis=1))
        return list(zip(at[good], points[good]))

    def _mirrored_leg(self, sequence, elements, points):
        """The way from the radar over mirror faces to points [P, 3]: (legs [E, P], first direction, last direction,
        amplitude, length that heights save); amplitude 0 where a face or the sight ends."""
        images, center = [elements], [self.position]
        for f in sequence:
            images.append(self._mirror(images[-1], f))
            center.append(self._mirror(center[-1], f))
        legs = [np.linalg.norm(points - e, axis=1) for e in images[-1]]
        last = points - center[-1]
        last /= np.linalg.norm(last, axis=1)[:, None]
        amplitude, saved, target = np.ones(len(points), complex), np.zeros(len(points)), points
        for m in reversed(range(len(sequence))):
            face = self.faces[sequence[m]]
            way = target - center[m + 1]
            down = way @ face.normal
            share = (face.origin - center[m + 1]) @ face.normal / np.where(np.abs(down) < 1e-9, 1e-9, down)
            hit = center[m + 1] + share[:, None] * way
            u, v = (hit - face.origin) @ face.e1, (hit - face.origin) @ face.e2
            ok = (share > 0) & (share < 1) & (u >= 0) & (u <= face.s1) & (v >= 0) & (v <= face.s2)
            i, j = face.cell(u, v)
            cosine = np.abs(down) / np.linalg.norm(way, axis=1)
            k = 2 * np.pi / self.front.wavelength_m
            loss = np.exp(-2 * (k * face.roughness_m * cosine)**2) * math.sqrt(1 - face.matter.scattering**2)
            amplitude = amplitude * ok * loss * 10**(face.level_db[i, j] / 20) * reflection(face.matter, cosine)
            saved = saved + 2 * cosine * face.wave[i, j]
            some = np.flatnonzero(ok)
            amplitude[some] *= visible(self.boxes, hit[some], target[some])
            target = hit
        some = np.flatnonzero(amplitude)
        amplitude[some] *= visible(self.boxes, self.position, target[some])
        first = target - self.position
        first /= np.linalg.norm(first, axis=1)[:, None]
        return legs, first, last, amplitude, saved

    def _higher_order(self, found, sequence, stationary):
        m = len(sequence) - 1 - int(np.argmin([self.size[f].prod() for f in sequence[::-1]]))
        face = self.faces[sequence[m]]
        u0, v0 = (stationary[m] - face.origin) @ face.e1, (stationary[m] - face.origin) @ face.e2
        i = np.flatnonzero(np.abs(face.u - u0) < WINDOW_M[1])
        j = np.flatnonzero(np.abs(face.v - v0) < WINDOW_M[1])
        if not len(i) or not len(j):
            return
        i, j = (a.ravel() for a in np.meshgrid(i, j, indexing="ij"))
        taper = 1.0
        for distance in (np.abs(face.u[i] - u0), np.abs(face.v[j] - v0)):
            taper = taper * np.cos(np.pi / 2 * np.clip((distance - WINDOW_M[0]) / (WINDOW_M[1] - WINDOW_M[0]), 0, 1))**2
        points = face.origin + face.u[i, None] * face.e1 + face.v[j, None] * face.e2
        out, first, last, amplitude, saved = self._mirrored_leg(sequence[:m], self.tx, points)
        back, first_back, last_back, amplitude_back, saved_back = self._mirrored_leg(sequence[:m:-1], self.rx, points)
        cosine_out, cosine_back = -last @ face.normal, -last_back @ face.normal
        weight = taper * amplitude * amplitude_back * ((cosine_out > 0) & (cosine_back > 0))
        use = np.flatnonzero(weight)
        if not len(use):
            return
        cut = lambda a: a[use]
        cosine = (cosine_out + cosine_back)[use] / 2
        index = np.full(len(use), sequence[m])
        size = np.stack([face.d1[i], face.d2[j]], axis=1)[use]
        gamma = reflection(face.matter, np.clip(cosine, 1e-3, 1)) * 10**(face.level_db[i, j][use] / 20)
        weight = (weight[use] * -1j / (4 * math.pi) * cosine * gamma * math.sqrt(1 - face.matter.scattering**2) *
                  self._adding_area(index, size, (last + last_back)[use],
                                     1 / out[0][use] + 1 / back[0][use]))
        shorter = (saved + saved_back)[use] + 2 * cosine * face.height[i, j][use]
        self._add(found, [cut(a) for a in out], [cut(a) for a in back], self.front.gains(first[use] @ self.rotation),
                  self.front.gains(first_back[use] @ self.rotation), weight, shorter)
