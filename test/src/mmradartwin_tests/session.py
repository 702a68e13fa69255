"""Measures a room: from paths to the int16 captures of a session directory (mmradartwin_session/1).

The chain of one session: plan the campaign; trace every pose in the true room; let hidden effects act on paths; sum
them to grids; let effects act on the received grids; choose one gain; write frames with thermal noise, quantised.
"""
import dataclasses
import json
import math
import multiprocessing
import os
import signal

import numpy as np

from mmradartwin_tests import campaign, office
from mmradartwin_tests.radar import Radar
from mmradartwin_tests.tracing import Tracer, path_arrays

# Thermal noise per complex sample in units of path amplitude: a concrete wall at 3 m (|Gamma| 0.39, 2.0e-5) then stands
# 50 dB over it in its range bin of one chirp and channel (16.3 dB of which the windowed transform gains).
NOISE_RMS = 4.1e-7
PEAK_DBFS = -9.0       # no sample of the session is above
GAIN_STEP_DB = 2.0     # as the receiver's gain codes
FULL_SCALE = 32768.0


def leave_signals_to_parent():
    """For processes of a pool: Ctrl-C reaches them, too, and the pool ends them by SIGTERM."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


@dataclasses.dataclass
class Settings:
    """What make_session is told."""
    output: str
    seed: int
    locations: int = 22
    headings: int = 7
    frames: int = 100
    poses: int = None
    tier: str = "default"
    speckle_seed: int = None
    pause_s: float = 8.0
    duplicates: int = None
    effects: list = dataclasses.field(default_factory=list)   # of mmradartwin_tests.effects.Effect
    truth: str = None
    paths_csv: str = None
    jobs: int = None
    actor_range_m: float = 0.02    # errors of the actors, 1 sigma, in the tier "office"
    actor_gain_db: float = 1.5
    at_reported: bool = False   # measure where the poses say: what a twin without any error could know


@dataclasses.dataclass
class Echoes:
    """Everything that returns from the room at one pose. Coefficients [P] follow the radar's convention."""
    paths: list
    lengths_m: np.ndarray        # [P, M]
    coefficients: np.ndarray     # [P]
    scatter: object
    scatter_coefficients: np.ndarray

    def add(self, paths):
        """Appends paths that the base model does not have."""
        if paths:
            lengths, coefficients = path_arrays(paths, self.lengths_m.shape[1])
            self.paths = self.paths + list(paths)
            self.lengths_m = np.concatenate([self.lengths_m, lengths])
            self.coefficients = np.concatenate([self.coefficients, coefficients])


class Measurement:
    """One campaign in one true room. Effects see it as their context."""

    def __init__(self, settings):
        self.settings = settings
        self.described_radar = Radar()
        self.radar = self.described_radar
        settings.effects.sort(key=lambda e: e.rank)
        for effect in settings.effects:
            self.radar = effect.radar(self.radar)
        self.described_actors = office.build_actors()
        self.described_materials = dict(office.MATERIALS)
        room = office.build_room(self.described_actors, self.described_materials)
        self.described_room = room
        duplicates = settings.duplicates
        if duplicates is None:
            duplicates = 2 if settings.poses is None else 0
        self.stations = campaign.plan(room, self.rng(1), settings.locations, settings.headings, settings.poses,
                                      settings.frames, self.radar.frame_period_s, settings.tier, settings.pause_s,
                                      duplicates)
        if settings.at_reported:
            for station in self.stations:
                station.true = station.reported
        actors, materials = office.build_actors(), dict(office.MATERIALS)
        for effect in settings.effects:
            effect.prepare(self)
        for effect in settings.effects:
            actors, materials = effect.room(self, actors, materials)
        for station in self.stations:
            for effect in settings.effects:
                station.true = effect.pose(self, station)
        self.room = office.build_room(actors, materials)
        self.speckle_seed = settings.seed if settings.speckle_seed is None else settings.speckle_seed
        self.tracer = Tracer(self.room, self.radar, speckle_seed=self.speckle_seed)
        self._prepare_tier()
        self.strongest = None    # strongest path of the session, after the IF filter
        self.noise_rms = NOISE_RMS
        self.gain = None

    def described_mechanisms(self):
        """Mechanisms of the twin that the session brings, None for the base without a file."""
        mechanisms = None
        for effect in self.settings.effects:
            mechanisms = effect.described_mechanisms(self, mechanisms)
        return mechanisms

    def rng(self, *stream):
        """Generator of one independent stream of the session's seed."""
        return np.random.default_rng([self.settings.seed, *stream])

    def _prepare_tier(self):
        rng = self.rng(2)
        office_like = self.settings.tier == "office"
        count = len(self.room.actors)
        self.actor_range_m = rng.normal(0, self.settings.actor_range_m, count) * office_like
        self.actor_gain_db = rng.normal(0, self.settings.actor_gain_db, count) * office_like
        self.clutter = None
        if office_like:
            points = rng.uniform([0.2, 0.2, 0.2], [office.LENGTH_M - 0.2, office.WIDTH_M - 0.2, 2.0], (200, 3))
            self.clutter = (points, rng.exponential(1.0, 200)**0.5, rng.uniform(0, 2 * np.pi, 200))

    def echoes(self, station):
        """Echoes of one pose, effects on paths included."""
        paths = self.tracer.specular(station.true)
        scatter = self.tracer.diffuse(station.true)
        lengths, coefficients = path_arrays(paths, self.radar.channels)
        turned = np.exp(1j * scatter.phase)
        if self.settings.tier == "office":
            shift = np.array([2 * sum(self.actor_range_m[a] * c for a, c in zip(p.actors, p.cosines)) for p in paths])
            gain = np.array([sum(self.actor_gain_db[a] for a in p.actors) for p in paths])
            if len(paths):
                lengths, coefficients = lengths + shift[:, None], coefficients * 10**(gain / 20)
            scatter.lengths_m = scatter.lengths_m + 2 * self.actor_range_m[scatter.actor][:, None]
            turned = turned * 10**(self.actor_gain_db[scatter.actor] / 20)
        echoes = Echoes(paths, lengths, coefficients, scatter, scatter.amplitude * turned)
        for effect in self.settings.effects:
            effect.echoes(self, station, echoes)
        return echoes

    def propagate(self, station):
        """(grid [M, N], clutter grid or None, strongest |coefficient|, rows of the path list, what effects keep)."""
        echoes = self.echoes(station)
        x = self.radar.grid(echoes.lengths_m, echoes.coefficients)
        x += self.radar.grid(echoes.scatter.lengths_m, echoes.scatter_coefficients)
        clutter = None
        if self.clutter is not None:
            points, amplitude, phase = self.clutter
            ray = points - station.true.position
            r = np.linalg.norm(ray, axis=1)
            seen = station.true.sees(ray / r[:, None]) & (r > 0.3)
            lengths = self.tracer.point_lengths(station.true, points[seen])
            clutter = self.radar.grid(lengths, amplitude[seen] / r[seen]**2 * np.exp(1j * phase[seen]))
        strongest = 0.0
        if len(echoes.paths):
            strongest = float(np.max(np.abs(echoes.coefficients)))
        auxiliary = {e.name: e.auxiliary(self, station, echoes) for e in self.settings.effects}
        return x, clutter, strongest, self.path_rows(station, echoes), auxiliary

    def beat_hz(self, length_m):
        """Beat frequency of a path length."""
        return self.radar.slope_hz_per_s * np.asarray(length_m) / 299792458.0

    def path_rows(self, station, echoes):
        """Rows of the path list (specular and corner paths), strongest first."""
        if not len(echoes.paths):
            return []
        first = self.radar.contributions(echoes.lengths_m[:, :1], echoes.coefficients)[:, 0]
        rows = []
        for i in np.argsort(-np.abs(first)):
            p = echoes.paths[i]
            angles = []
            for direction in (p.departure, p.arrival):
                d = station.true.to_radar(direction)
                angles += [math.degrees(math.atan2(d[1], d[0])), math.degrees(math.asin(max(-1.0, min(1.0, d[2]))))]
            names = [self.room.actors[a] for a in p.actors]
            rows.append([f"{echoes.lengths_m[i, 0]:.6f}", *(f"{a:.5f}" for a in angles),
                         f"{20 * math.log10(max(abs(first[i]), 1e-30)):.5f}", f"{np.angle(first[i]):.6f}",
                         str(len(p.actors)),
                         p.event, ";".join(a.name for a in names), ";".join(a.tag for a in names)])
        return rows

    def measure(self, station_index, x):
        """int16 samples [F, chirps, N, 2, R] of one pose from its received grid [M, N], gain and noise applied."""
        settings, radar = self.settings, self.radar
        station = self.stations[station_index]
        frames = np.broadcast_to(x, (settings.frames, *x.shape))
        rng = self.rng(3, station_index)
        for effect in settings.effects:
            frames = effect.frames(self, station_index, station, frames, self.rng(4, station_index))
        shape = (settings.frames, radar.loops, len(radar.tx), len(radar.rx), radar.samples)
        cube = np.broadcast_to(frames.reshape(settings.frames, 1, *shape[2:]), shape)
        cube = cube.transpose(0, 1, 2, 4, 3)     # frame, loop, slot, sample, rx
        noise_rms = self.noise_rms / math.sqrt(2)
        samples = np.empty((*cube.shape[:4], 2, cube.shape[4]))
        samples[..., 0, :], samples[..., 1, :] = cube.real, cube.imag
        samples += noise_rms * rng.standard_normal(samples.shape, dtype=np.float32)
        samples *= self.gain * FULL_SCALE
        return np.clip(np.rint(samples), -32768, 32767).astype("<i2")

    def receive(self):
        """Traces all poses; returns (received grids [M, N], path lists) and fixes gain and noise. Writes nothing."""
        settings = self.settings
        jobs = settings.jobs or min(len(self.stations), os.cpu_count() or 1)
        self.tracer.diffuse(self.stations[0].true)   # the scatter points are then shared by all processes
        if jobs > 1:
            with multiprocessing.get_context("fork").Pool(jobs, leave_signals_to_parent) as pool:
                results = pool.map(self.propagate, self.stations, chunksize=2)
        else:
            results = [self.propagate(s) for s in self.stations]
        self.strongest = max(r[2] for r in results)
        self.auxiliary = {e.name: [r[4][e.name] for r in results] for e in settings.effects}
        grids = [r[0] for r in results]
        if self.clutter is not None:
            echo = sum(np.sum(np.abs(g)**2) for g in grids)
            level = math.sqrt(1e-3 * echo / sum(np.sum(np.abs(r[1])**2) for r in results))
            grids = [g + level * r[1] for g, r in zip(grids, results)]
        received = []
        for i, (station, x) in enumerate(zip(self.stations, grids)):
            for effect in settings.effects:
                x = effect.receive(self, i, station, x)
            received.append(x)
        peak = max(max(np.abs(x.real).max(), np.abs(x.imag).max()) for x in received)
        step = math.floor((PEAK_DBFS - 20 * math.log10(peak)) / GAIN_STEP_DB) * GAIN_STEP_DB
        self.gain = 10**(step / 20)
        for effect in settings.effects:
            effect.after_gain(self, received)
        return received, [r[3] for r in results]

    def run(self):
        """Writes the session directory, truth and path lists; returns what receive() does."""
        settings = self.settings
        received, path_lists = self.receive()
        directory = settings.output
        os.makedirs(os.path.join(directory, "captures"), exist_ok=True)
        for i, (station, x) in enumerate(zip(self.stations, received)):
            payload = self.measure(i, x).tobytes()
            for effect in settings.effects:
                payload = effect.payload(self, i, station, payload, self.rng(5, i))
            with open(os.path.join(directory, "captures", f"{station.name}.bin"), "wb") as out:
                out.write(payload)
        write_description(directory, self)
        if settings.paths_csv:
            os.makedirs(settings.paths_csv, exist_ok=True)
            for station, rows in zip(self.stations, path_lists):
                write_paths(os.path.join(settings.paths_csv, f"{station.name}.csv"), rows)
        if settings.truth:
            with open(settings.truth, "w", encoding="ascii") as out:
                json.dump(self.truth(), out, indent=1)
        return received, path_lists

    def hidden(self):
        """[{"cause", "parameters", "beside"}] of the effects."""
        return [{"cause": e.name, "parameters": e.truth(self), "beside": e.beside()} for e in self.settings.effects]

    def truth(self):
        """What a diagnosis must not see."""
        return {
            "seed": self.settings.seed, "speckle_seed": self.speckle_seed, "tier": self.settings.tier,
            "effects": self.hidden(),
            "gain_db": 20 * math.log10(self.gain), "noise_rms": self.noise_rms, "strongest_amplitude": self.strongest,
            "poses": {s.name: {"position_m": list(s.true.position),
                               "quaternion_xyzw": list(campaign.quaternion(s.true.rotation))}
                      for s in self.stations},
        }


PATHS_HEADER = ("length_m,azimuth_dep_deg,elevation_dep_deg,azimuth_arr_deg,elevation_arr_deg,amplitude_db,phase_rad,"
                "bounces,event,actors,materials")


def write_paths(file, rows):
    """One path list."""
    with open(file, "w", encoding="ascii") as out:
        out.write(PATHS_HEADER + "\n")
        for row in rows:
            out.write(",".join(row) + "\n")


def write_description(directory, measurement):
    """session.yaml, radar.yaml, scene files and poses.csv: what the user believes."""
    office.write_scene(directory, measurement.described_actors, measurement.described_materials)
    with open(os.path.join(directory, "radar.yaml"), "w", encoding="ascii") as out:
        out.write(measurement.described_radar.yaml())
    with open(os.path.join(directory, "poses.csv"), "w", encoding="ascii") as out:
        out.write("pose,location,stamp,x,y,z,qx,qy,qz,qw\n")
        for s in measurement.stations:
            stamp = f"{s.stamp_ns // 10**9}.{s.stamp_ns % 10**9:09d}"
            numbers = [*(f"{v:.6f}" for v in s.reported.position),
                       *(f"{v:.9f}" for v in campaign.quaternion(s.reported.rotation))]
            out.write(",".join([s.name, s.location, stamp, *numbers]) + "\n")
    with open(os.path.join(directory, "session.yaml"), "w", encoding="ascii") as out:
        mechanisms = measurement.described_mechanisms()
        twin = "" if mechanisms is None else "twin: twin.yaml\n"
        out.write("format: mmradartwin_session/1\nradar: radar.yaml\nscene: scene.yaml\n" + twin +
                  "poses: poses.csv\ncaptures: captures/{pose}.bin\n")
    if mechanisms is not None:
        with open(os.path.join(directory, "twin.yaml"), "w", encoding="ascii") as out:
            out.write("scene: scene.yaml\nradar: radar.yaml\nmechanisms:\n")
            for name, values in mechanisms.items():
                out.write(f"  {name}: {{" + ", ".join(f"{k}: {v:g}" for k, v in values.items()) + "}\n")
