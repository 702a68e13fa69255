"""A room as distances on a grid, and the mesh of its surface: what reconstructions from depth images make of a room."""
import numpy as np

from mmradartwin_tests.geometry import Box, Cylinder, Rectangle
from mmradartwin_tests.scans.known_room import SHEET_M, outline_distance

MARGIN = 4       # cells around the room
TRUNCATION = 3   # cells: farther distances are cut off, as fused depth images have them


def box_distance(points, center, half, rotation):
    """[P] signed distance to a solid box, negative inside."""
    q = np.abs((points - center) @ rotation) - half
    return np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0)


def part_distance(part, points):
    """[P] signed distance of places to a box, sheet or cylinder, negative inside."""
    if isinstance(part, Box):
        return box_distance(points, part.center, part.size / 2, part.rotation)
    if isinstance(part, Rectangle):
        turn = np.stack([part.e1, part.e2, np.cross(part.e1, part.e2)], axis=1)
        middle = part.origin + part.s1 / 2 * part.e1 + part.s2 / 2 * part.e2
        return box_distance(points, middle, np.array([part.s1, part.s2, SHEET_M]) / 2, turn)
    q = points - part.center
    side = np.stack([np.hypot(q[:, 0], q[:, 1]) - part.radius, np.abs(q[:, 2]) - part.height / 2], axis=1)
    return np.linalg.norm(np.maximum(side, 0.0), axis=1) + np.minimum(side.max(axis=1), 0.0)


def part_bounds(part):
    """(low [3], high [3]) of a box, sheet or cylinder."""
    if isinstance(part, Cylinder):
        reach = np.array([part.radius, part.radius, part.height / 2])
        return part.center - reach, part.center + reach
    corners = np.array([r.origin + a * r.s1 * r.e1 + b * r.s2 * r.e2 for r in part.rectangles() for a in (0, 1)
                        for b in (0, 1)])
    return corners.min(axis=0), corners.max(axis=0)


class DistanceGrid:
    """values[i, j, k]: signed distance at low + step * (i, j, k), positive in the air, cut off at TRUNCATION steps."""

    def __init__(self, room, step_m):
        self.step_m = step_m
        self.low = np.array([*room.outline.min(axis=0), 0.0]) - MARGIN * step_m * 1.013
        high = np.array([*room.outline.max(axis=0), room.height_m])
        shape = np.ceil((high - self.low) / step_m).astype(int) + MARGIN
        x, y, z = (self.low[k] + step_m * np.arange(shape[k]) for k in range(3))
        plan = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        walls = outline_distance(room.outline, plan).reshape(shape[0], shape[1]).astype(np.float32)
        height = np.minimum(z, room.height_m - z).astype(np.float32)
        self.values = np.minimum(walls[:, :, None], height[None, None, :])
        cut = TRUNCATION * step_m
        for part in (p for actor in room.solids() for p in actor.parts):
            near, far = part_bounds(part)
            a = np.maximum(np.floor((near - cut - self.low) / step_m).astype(int), 0)
            b = np.minimum(np.ceil((far + cut - self.low) / step_m).astype(int) + 1, shape)
            axes = [self.low[k] + step_m * np.arange(a[k], b[k]) for k in range(3)]
            places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
            block = part_distance(part, places).reshape(b - a).astype(np.float32)
            window = self.values[a[0]:b[0], a[1]:b[1], a[2]:b[2]]
            np.minimum(window, block, out=window)
        np.clip(self.values, -cut, cut, out=self.values)

    def smooth(self, sigma_steps):
        """Blurs the distances, which rounds edges and eats what is thin."""
        reach = int(np.ceil(3 * sigma_steps))
        weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma_steps)**2)
        weights = (weights / weights.sum()).astype(np.float32)
        for axis in range(3):
            padded = np.pad(self.values, [(reach, reach) if k == axis else (0, 0) for k in range(3)], mode="edge")
            length, total = self.values.shape[axis], np.zeros_like(self.values)
            for k, weight in enumerate(weights):
                total += weight * np.take(padded, range(k, k + length), axis=axis)
            self.values = total

    def surface(self):
        """(vertices [V, 3], quads [Q, 4]) of the surface where the distance is 0, by surface nets: one vertex for each
        cell that the surface passes, in the middle of where it cuts the cell's edges. Quads face the air."""
        f = self.values
        solid = f < 0
        corners = [(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)]
        part = lambda array, s: array[s[0]:array.shape[0] - 1 + s[0], s[1]:array.shape[1] - 1 + s[1],
                                      s[2]:array.shape[2] - 1 + s[2]]
        count = np.zeros(tuple(np.array(f.shape) - 1), np.int8)
        for s in corners:
            count += part(solid, s)
        cells = np.argwhere((count > 0) & (count < 8))
        index = np.full(count.shape, -1, np.int64)
        index[tuple(cells.T)] = np.arange(len(cells))
        at = np.stack([f[tuple((cells + s).T)] for s in corners], axis=1)
        total, cuts = np.zeros((len(cells), 3)), np.zeros(len(cells))
        for i, s in enumerate(corners):
            for axis in range(3):
                if s[axis]:
                    continue
                j = corners.index(tuple(1 if k == axis else s[k] for k in range(3)))
                a, b = at[:, i], at[:, j]
                crossed = (a < 0) != (b < 0)
                t = np.where(crossed, a / np.where(crossed, a - b, 1), 0)
                place = np.tile(np.array(s, float), (len(cells), 1))
                place[:, axis] = t
                total += crossed[:, None] * place
                cuts += crossed
        vertices = self.low + self.step_m * (cells + total / cuts[:, None])
        quads = []
        for axis in range(3):
            b, c = (axis + 1) % 3, (axis + 2) % 3
            here = [slice(0, -1) if k == axis else slice(1, -1) for k in range(3)]
            there = [slice(1, None) if k == axis else slice(1, -1) for k in range(3)]
            inside, beyond = solid[tuple(here)], solid[tuple(there)]
            for way, flip in ((inside & ~beyond, False), (~inside & beyond, True)):
                edge = np.argwhere(way)
                edge[:, b] += 1
                edge[:, c] += 1
                around = []
                for db, dc in ((-1, -1), (0, -1), (0, 0), (-1, 0)):
                    cell = edge.copy()
                    cell[:, b] += db
                    cell[:, c] += dc
                    around.append(index[tuple(cell.T)])
                quad = np.stack(around, axis=1)
                quads.append(quad[:, ::-1] if flip else quad)
        return vertices, np.concatenate(quads)
