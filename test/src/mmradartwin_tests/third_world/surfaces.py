"""Rough walls and furniture as small patches, with heights and reflectivity that vary over each face. Metres, map."""
import dataclasses
import math

import numpy as np

PATCH_M = 0.013
BLOCK = 5          # patches of one block along each edge; a block is in shadow or not


@dataclasses.dataclass
class Matter:
    """What a face is made of at 77 GHz, and how rough it is."""
    permittivity: complex = 1.0      # eps' - j eps''; None: metal
    scattering: float = 0.0          # share S^2 of the reflected power scatters into all directions
    roughness_m: float = 6e-5        # rms, from patch to patch


@dataclasses.dataclass
class Nature:
    """How far the world differs from flat and even faces; a property is switched off by 0."""
    waviness_m: float = 0.0008       # rms; a face then deviates by about 2 mm at most
    waviness_length_m: float = 0.7
    unevenness_db: float = 1.3       # rms of the reflectivity over a face, about 3 dB at most
    unevenness_length_m: float = 0.6
    roughness: float = 1.0           # factor of the matter's own


def smooth_field(rng, shape, steps_m, length_m):
    """Gaussian random field of unit variance with the correlation exp(-(r/length)^2)."""
    sizes = [n + int(math.ceil(2.5 * length_m / step)) for n, step in zip(shape, steps_m)]
    k1, k2 = (2 * np.pi * np.fft.fftfreq(n, step) for n, step in zip(sizes, steps_m))
    response = np.exp(-(k1[:, None]**2 + k2**2) * length_m**2 / 8)
    white = rng.standard_normal(sizes)
    field = np.fft.ifft2(np.fft.fft2(white) * response).real / math.sqrt(np.mean(response**2))
    return field[:shape[0], :shape[1]]


def uneven_edges(rng, length_m):
    """Edges of patches of PATCH_M on average along a length."""
    count = max(1, int(round(length_m / PATCH_M)))
    sizes = rng.uniform(0.7, 1.3, count)
    return np.concatenate([[0.0], np.cumsum(sizes)]) * length_m / sizes.sum()


class Face:
    """A rectangle seen from its normal's side, cut into patches."""

    def __init__(self, actor, matter, origin, e1, e2, s1, s2, rng, nature):
        self.actor, self.matter = actor, matter
        self.origin, self.e1, self.e2 = (np.asarray(v, float) for v in (origin, e1, e2))
        self.s1, self.s2 = float(s1), float(s2)
        self.normal = np.cross(self.e1, self.e2)
        # Patches of one size would be a grating: they differ.
        self.u_edges, self.v_edges = uneven_edges(rng, self.s1), uneven_edges(rng, self.s2)
        self.d1, self.d2 = np.diff(self.u_edges), np.diff(self.v_edges)
        self.u, self.v = self.u_edges[:-1] + self.d1 / 2, self.v_edges[:-1] + self.d2 / 2
        self.shape = (len(self.u), len(self.v))
        steps = (self.s1 / self.shape[0], self.s2 / self.shape[1])
        self.wave = nature.waviness_m * smooth_field(rng, self.shape, steps, nature.waviness_length_m)
        self.level_db = nature.unevenness_db * smooth_field(rng, self.shape, steps, nature.unevenness_length_m)
        self.roughness_m = nature.roughness * matter.roughness_m
        self.height = self.wave + self.roughness_m * rng.standard_normal(self.shape)
        self.scatter = (rng.standard_normal(self.shape) + 1j * rng.standard_normal(self.shape)) / math.sqrt(2)

    def points(self):
        """[n1, n2, 3] centres of the patches, without heights."""
        return self.origin + self.u[:, None, None] * self.e1 + self.v[:, None] * self.e2

    def cell(self, u, v):
        """Indices of the patches at places of the face; places beyond its edges give those at the edge."""
        return (np.clip(np.searchsorted(edges, place) - 1, 0, len(edges) - 2)
                for edges, place in ((self.u_edges, u), (self.v_edges, v)))


def strip_sum(size_m, slope, curvature):
    """Integral of exp(j (slope x + curvature x^2)) over a strip about 0, where the curvature turns it by little."""
    q = slope * size_m / 2
    sinc = np.sinc(q / np.pi)
    small = np.abs(q) < 1e-2
    square = np.where(small, 1 / 3, sinc + 2 * (np.cos(q) - sinc) / np.where(small, 1.0, q)**2)
    return size_m * (sinc + 1j * curvature * size_m**2 / 4 * square)


def reflection(matter, cosine):
    """Coefficient of a vertical field at a vertical face; metal is -1."""
    if matter.permittivity is None:
        return np.full(np.shape(cosine), -1.0 + 0j)
    root = np.sqrt(matter.permittivity - 1 + np.asarray(cosine)**2 + 0j)
    # Conjugated: phases grow with the path's length here.
    return np.conj((cosine - root) / (cosine + root))


@dataclasses.dataclass
class Box:
    """A closed box that stands upright, turned about z: it has four faces and casts shadows."""
    center: np.ndarray
    size: np.ndarray
    yaw_rad: float

    def axes(self):
        """Rows: the box's x, y, z in map."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])

    def sides(self):
        """(origin, e1, e2, s1, s2) of the four upright faces, e1 x e2 outward."""
        x, y, z = self.axes()
        half = self.size / 2
        found = []
        for normal, along, h_n, h_a in ((x, y, 0, 1), (y, -x, 1, 0), (-x, -y, 0, 1), (-y, x, 1, 0)):
            origin = self.center + half[h_n] * normal - half[h_a] * along - half[2] * z
            found.append((origin, along, z, self.size[h_a], self.size[2]))
        return found


def visible(boxes, a, b, gap_m=2e-3):
    """[P] whether the way from a to b [P, 3] (or one point) meets no box."""
    a, b = np.broadcast_arrays(np.atleast_2d(a), np.atleast_2d(b))
    free = np.ones(len(a), bool)
    way = b - a
    gap = gap_m / np.maximum(np.linalg.norm(way, axis=1), 1e-9)
    for box in boxes:
        axes, half = box.axes(), box.size / 2
        o, d = (a - box.center) @ axes.T, way @ axes.T
        d = np.where(np.abs(d) < 1e-12, 1e-12, d)
        near, far = (-half - o) / d, (half - o) / d
        enter = np.maximum(np.minimum(near, far).max(axis=1), gap)
        leave = np.minimum(np.maximum(near, far).min(axis=1), 1 - gap)
        free &= enter >= leave
    return free
