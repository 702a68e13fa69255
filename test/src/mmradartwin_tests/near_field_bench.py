"""A near-field bench as people build one: a metal plate in front of the radar, a rail between them, a room behind.

1 transmitter and 4 receivers, a fine range bin (4.2 cm). Every echo is the integral of physical optics over its flat
surface, with spherical waves from the transmitter and to each receiver, at every sample's frequency:

    (1 / lambda) * integral of lambda/(4 pi) * exp(j k (r1 + r2)) / (r1 r2) * cos(incidence) dA ,

which is lambda / (4 pi s) before a large plate. What bounces between plate and radar goes over a point of the radar's
body and the same integrals. Nothing here is far field, and nothing is shared with the simulator.
"""
import dataclasses
import math
import os

import numpy as np

from mmradartwin_tests.campaign import START_S, quaternion
from mmradartwin_tests.geometry import Actor, rotation_z, sheet
from mmradartwin_tests.office import MATERIALS, materials_yaml, write_obj
from mmradartwin_tests.radar import SPEED_OF_LIGHT, Radar

PITCH_M = 0.0019467   # half a wavelength at 77 GHz
NOISE_DBFS = -62.0    # thermal noise of one sample
PEAK_DBFS = -6.0      # the strongest sample of the session
HEIGHT_M = 1.0        # of radar and plate over the floor
PLATE_X_M = 1.0       # the plate's plane, in map
PLATE_SIZE_M = 0.20
SCENE_M = 0.005   # to which the user measured the bench, 1 sigma
RAIL_ERROR_M, HEADING_ERROR_DEG = 0.0005, 0.1   # 1 sigma, of what the user writes down
BODY_M = 0.085        # amplitude of the radar's own echo: sqrt(RCS / 4 pi)


def bench_radar(samples=512):
    """63.3 MHz/us at 9.121 Msps; fewer samples keep the range bin and shorten the range."""
    rate_hz = 9.121e6
    return Radar(slope_hz_per_s=63.3e12, samples=samples, sample_rate_hz=rate_hz * samples / 512,
                 adc_start_s=4.0e-6, tx=np.array([[0.0, -0.0117, 0.0]]),
                 rx=np.array([[0.0, PITCH_M * k, 0.0] for k in range(4)]))


@dataclasses.dataclass
class Faults:
    """What is wrong with the radar against its twin. Lists are over receivers."""
    range_bias_m: float = 0.0
    phase_deg: tuple = (0.0, 0.0, 0.0, 0.0)
    leakage_db: float = None           # rms over receivers, over the session's strongest echo
    leakage_range_m: float = 0.075     # one-way, the delay inside the radar included
    leakage_gain_db: tuple = (0.0, -4.4, 2.1, -1.9)
    leakage_phase_deg: tuple = (0.0, 71.0, -128.0, 163.0)
    image_db: tuple = None
    image_phase_deg: tuple = (31.0, -64.0, 118.0, -15.0)
    bounces: int = 0                   # how often the wave returns to the plate after its first echo


BUILT = Faults(range_bias_m=0.0623, phase_deg=(0.0, 0.0, -10.0, 0.0), leakage_db=-4.0,
               image_db=(-36.5, -34.7, -28.5, -37.7), bounces=2)


@dataclasses.dataclass
class Station:
    """Where the radar stands: before the plate, turned to the left."""
    distance_m: float
    heading_deg: float
    location: str

    @property
    def position(self):
        """The reference element, in map."""
        return np.array([PLATE_X_M - self.distance_m, 2.0, HEIGHT_M])

    @property
    def rotation(self):
        """radar_link to map."""
        return rotation_z(math.radians(self.heading_deg))


def stations(count=16):
    """The rail's stops from 0.35 m on: four near each other, 11 cm on again four; the radar's stand is turned at each."""
    headings = (-3.0, 1.0, 3.0, -1.0)
    return [Station(0.349 + 0.11 * (i // 4) + 0.012 * (i % 4), headings[i % 4], f"stop{i}") for i in range(count)]


def actors():
    """The plate and what stands behind it. The wall behind the plate is in its shadow where it would mirror."""
    y, z, half = 2.0, HEIGHT_M, PLATE_SIZE_M / 2
    cabinet = rotation_z(math.radians(40.0))
    rail = np.array([0.45, y, z])   # about the middle of the rail; the cabinet faces it
    return [
        Actor("plate", "Metal", [sheet((PLATE_X_M, y - half, z - half), (0, 2 * half, 0), (0, 0, 2 * half))]),
        Actor("wall", "Concrete", [sheet((4.0, 0.5, 0), (0, 3.0, 0), (0, 0, 2.6))]),
        Actor("cabinet", "Metal", [sheet(rail + cabinet @ np.array([2.3, -0.5, -0.6]), cabinet @ np.array([0, 1.0, 0]),
                                         (0, 0, 1.2))]),
    ]


REFLECTS = {"plate": 1.0, "cabinet": 1.0}   # |Gamma| at normal incidence; the wall is in the plate's shadow
PANEL_STEP_M = {"plate": 0.0008, "cabinet": 0.002}


class PanelOptics:
    """Physical optics of one flat rectangle."""

    def __init__(self, rectangle, step_m):
        self.normal = np.cross(rectangle.e1, rectangle.e2)
        nodes = [self._gauss(s, step_m) for s in (rectangle.s1, rectangle.s2)]
        (a, wa), (b, wb) = nodes
        self.points = (rectangle.origin + a[:, None, None] * rectangle.e1 + b[None, :, None] * rectangle.e2)
        self.points = self.points.reshape(-1, 3)
        self.area = (wa[:, None] * wb[None, :]).ravel()

    @staticmethod
    def _gauss(length, step_m):
        """Nodes and weights of 16-point Gauss-Legendre rules side by side, about a node per step."""
        parts = max(1, math.ceil(length / step_m / 16))
        x, w = np.polynomial.legendre.leggauss(16)
        width = length / parts
        starts = width * np.arange(parts)
        return ((starts[:, None] + width * (x + 1) / 2).ravel(), np.tile(w * width / 2, parts))

    def field(self, source, receiver, frequency_hz):
        """[F] exp(+j k (r1 + r2)) summed over the panel, so that a large one gives exp(j k s) / s at its image."""
        d1, d2 = self.points - source, self.points - receiver
        r1, r2 = np.linalg.norm(d1, axis=1), np.linalg.norm(d2, axis=1)
        cosine = 0.5 * (np.abs(d1 @ self.normal) / r1 + np.abs(d2 @ self.normal) / r2)
        weight = self.area * cosine / (r1 * r2)
        return spectrum(r1 + r2, weight, frequency_hz) * (-1j) * frequency_hz / SPEED_OF_LIGHT


def spectrum(lengths_m, weights, frequency_hz, step_m=1e-5):
    """[F] sum of weights * exp(+j k length). Lengths are shared out between the two nearest of a fine grid."""
    first = lengths_m.min()
    place = (lengths_m - first) / step_m
    low = place.astype(int)
    share = place - low
    count = int(low.max()) + 2
    bins = np.bincount(low, weights * (1 - share), count) + np.bincount(low + 1, weights * share, count)
    k = 2 * np.pi * frequency_hz / SPEED_OF_LIGHT
    # Sum over the grid as a product of a coarse and a fine turn.
    block = 64
    rows = -(-count // block)
    padded = np.zeros(rows * block)
    padded[:count] = bins
    fine = np.exp(1j * np.outer(step_m * np.arange(block), k))
    inner = padded.reshape(rows, block) @ fine
    return np.sum(inner * np.exp(1j * np.outer(first + step_m * block * np.arange(rows), k)), axis=0)


class Bench:
    """The measured bench: echoes of all stations, and the captures of a session directory."""

    def __init__(self, faults=BUILT, places=None, samples=512, frames=8, seed=5):
        self.faults, self.frames, self.seed = faults, frames, seed
        self.radar = bench_radar(samples)
        self.reported = stations() if places is None else places
        rng = np.random.default_rng([seed, 1000])
        self.stations = [Station(s.distance_m + RAIL_ERROR_M * rng.standard_normal(),
                                 s.heading_deg + HEADING_ERROR_DEG * rng.standard_normal(), s.location)
                         for s in self.reported]
        self.actors = actors()
        self.panels = {a.name: PanelOptics(a.parts[0].rectangles()[0], PANEL_STEP_M[a.name])
                       for a in self.actors if a.name in REFLECTS}

    def echoes(self, station):
        """{name: x[M, N]} of one station without any fault but the bounces, dimensionless amplitudes."""
        radar = self.radar
        frequency = radar.carrier_hz + radar.slope_hz_per_s * (radar.adc_start_s +
                                                               np.arange(radar.samples) / radar.sample_rate_hz)
        element = lambda p: station.position + station.rotation @ p
        tx, receivers = element(radar.tx[0]), [element(p) for p in radar.rx]
        scale = SPEED_OF_LIGHT / frequency / (4 * np.pi)
        echoes = {name: np.array([REFLECTS[name] * scale * panel.field(tx, r, frequency) for r in receivers])
                  for name, panel in self.panels.items()}
        body = 0.5 * (tx + receivers[-1])
        out, around = (self.panels["plate"].field(a, body, frequency) for a in (tx, body))
        back = [self.panels["plate"].field(body, r, frequency) for r in receivers]
        for n in range(1, self.faults.bounces + 1):
            echoes[f"bounce{n}"] = np.array([scale * BODY_M**n * out * around**(n - 1) * b for b in back])
        return echoes

    def grid(self, station):
        """x[M, N] without leakage and image."""
        radar, faults = self.radar, self.faults
        x = sum(self.echoes(station).values())
        # A delay inside the radar turns the beat by its own frequency.
        delay = 2 * faults.range_bias_m / SPEED_OF_LIGHT
        t = radar.adc_start_s + np.arange(radar.samples) / radar.sample_rate_hz
        x = x * np.exp(2j * np.pi * (radar.carrier_hz * delay + radar.slope_hz_per_s * delay * t))
        return x * np.exp(1j * np.radians(faults.phase_deg))[:, None]

    def leakage(self, strongest):
        """x[M, 1 .. N] of the leakage."""
        radar, faults = self.radar, self.faults
        vector = 10**(np.array(faults.leakage_gain_db) / 20) * np.exp(1j * np.radians(faults.leakage_phase_deg))
        vector /= math.sqrt(np.mean(np.abs(vector)**2))
        tau = 2 * faults.leakage_range_m / SPEED_OF_LIGHT
        t = radar.adc_start_s + np.arange(radar.samples) / radar.sample_rate_hz
        tone = np.exp(2j * np.pi * radar.slope_hz_per_s * tau * (t - radar.center_s))
        return 10**(faults.leakage_db / 20) * strongest * vector[:, None] * tone

    def received(self):
        """Grids [M, N] of all stations as the converter sees them, without noise."""
        grids = [self.grid(s) for s in self.stations]
        window = np.hanning(self.radar.samples + 1)[:-1]
        spectra = [np.abs(np.fft.fft(g * window, axis=1)) / window.sum() for g in grids]
        self.strongest = max(math.sqrt((s**2).mean(axis=0).max()) for s in spectra)
        if self.faults.leakage_db is not None:
            grids = [g + self.leakage(self.strongest) for g in grids]
        if self.faults.image_db is not None:
            beta = (10**(np.array(self.faults.image_db) / 20) * np.exp(1j * np.radians(self.faults.image_phase_deg)))
            grids = [g + beta[:, None] * g.conj() for g in grids]
        return grids

    def write(self, directory):
        """Writes the session directory: what the user believes, and what the card recorded."""
        os.makedirs(os.path.join(directory, "captures"), exist_ok=True)
        grids = self.received()
        peak = max(max(np.abs(g.real).max(), np.abs(g.imag).max()) for g in grids)
        gain = 10**(PEAK_DBFS / 20) / peak * 32768
        noise = 10**(NOISE_DBFS / 20) * 32768 / math.sqrt(2)
        names = [f"{i:03d}" for i in range(len(self.stations))]
        for i, (name, g) in enumerate(zip(names, grids)):
            rng = np.random.default_rng([self.seed, i])
            shape = (self.frames, self.radar.samples, 2, len(self.radar.rx))
            values = np.broadcast_to(np.stack([g.real.T, g.imag.T], axis=1) * gain, shape)
            samples = values + noise * rng.standard_normal(shape)
            samples = np.clip(np.rint(samples), -32768, 32767).astype("<i2")
            samples.tofile(os.path.join(directory, "captures", f"{name}.bin"))
        texts = {
            "radar.yaml": self.radar.yaml(),
            "scene.yaml": "meshes:\n  - {file: bench.obj}\nmaterials: materials.yaml\n",
            "materials.yaml": materials_yaml({t: dataclasses.replace(MATERIALS[t], scattering=0.0)
                                              for t in ("Metal", "Concrete")}),
            "session.yaml": "format: mmradartwin_session/1\nradar: radar.yaml\nscene: scene.yaml\nposes: poses.csv\n"
                            f"captures: captures/{{pose}}.bin\naccuracy: {{scene_m: {SCENE_M}, pose_m: {2 * RAIL_ERROR_M}}}\n",
            "poses.csv": "pose,location,stamp,x,y,z,qx,qy,qz,qw\n" + "".join(
                ",".join([name, s.location, f"{START_S + 10 * i}.0", *(f"{v:.6f}" for v in s.position),
                          *(f"{v:.9f}" for v in quaternion(s.rotation))]) + "\n"
                for i, (name, s) in enumerate(zip(names, self.reported))),
        }
        for file, text in texts.items():
            with open(os.path.join(directory, file), "w", encoding="ascii") as out:
                out.write(text)
        write_obj(self.actors, os.path.join(directory, "bench.obj"))
