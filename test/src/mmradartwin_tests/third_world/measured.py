"""Measures a session of the third world: draws the room and the campaign, hides one cause or none, writes the files."""
import dataclasses
import math
import os

import numpy as np

from mmradartwin_tests import geometry, office, session
from mmradartwin_tests.campaign import Station
from mmradartwin_tests.radar import Radar
from mmradartwin_tests.third_world import hidden, rooms
from mmradartwin_tests.third_world.antenna import C, Front
from mmradartwin_tests.third_world.optics import STEP_M, Wire, World
from mmradartwin_tests.third_world.surfaces import Box, Face, Matter, Nature

NOISE_RMS = 4.1e-7       # of a complex sample, in units of path amplitude
PEAK = 0.35              # of full scale
FRAMES = 8
EPSILON_0 = 8.8541878128e-12
# What the world has and the twin has not; each can be left out to find out what breaks a diagnosis.
PROPERTIES = ("waviness", "unevenness", "roughness", "scattering", "levels", "places", "rods", "things", "pose_drift",
              "gain_drift", "images", "compression", "ripple")
SCENE_M, WALL_M, TURN_DEG, LEVEL_DB = 0.010, 0.007, 0.25, 1.0
POSE_M, HEADING_DEG = 0.007, 0.2
STATED = "accuracy: {scene_m: 0.012, level_db: 1.5, pose_m: 0.007, heading_deg: 0.2}\n"


@dataclasses.dataclass
class Pose:
    """Position [3] and rotation [3, 3], radar axes to map."""
    position: np.ndarray
    rotation: np.ndarray


def turn(axis, angle_rad):
    """Rotation about x (0), y (1) or z (2)."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    m = np.eye(3)
    m[a, a] = m[b, b] = math.cos(angle_rad)
    m[a, b], m[b, a] = -math.sin(angle_rad), math.sin(angle_rad)
    return m


def slow(rng, count, rms):
    """[count] something that drifts over a session; its mean is not zero."""
    t = np.arange(count) / count
    wave = sum(rng.normal() * np.cos(2 * np.pi * rng.uniform(0.3, 2.5) * t + rng.uniform(0, 2 * np.pi))
               for _ in range(3))
    return rms * wave / math.sqrt(1.5)


def on_grid(level_db):
    """Amplitude of a level."""
    return 10**(level_db / 20)


class ThirdWorld:
    """One session. cause: of hidden.CAUSES or None; without: PROPERTIES that are left out."""

    def __init__(self, seed, cause=None, kind=None, without=(), poses=24):
        self.seed, self.without = seed, set(without)
        if self.without - set(PROPERTIES):
            raise ValueError(f"no property {', '.join(sorted(self.without - set(PROPERTIES)))}; "
                             f"there are {', '.join(PROPERTIES)}")
        self.plan = rooms.draw_plan(self.rng(0), kind)
        spots = self._spots(poses)
        self.cause = cause
        self.hidden = hidden.CAUSES[cause](self.rng(2), self.plan, spots) if cause else {}
        self._stations(spots)
        self.described_radar = Radar()
        self._build()

    def rng(self, *stream):
        """One independent stream of the seed."""
        return np.random.default_rng([self.seed, 3, *stream])

    def has(self, name):
        """1.0 where a property of the world is not left out."""
        return 0.0 if name in self.without else 1.0

    def of(self, cause, name, otherwise=0.0):
        """A parameter of the hidden cause."""
        return self.hidden.get(name, otherwise) if self.cause == cause else otherwise

    def _spots(self, count):
        """[count, 3] places of the radar, two headings at a place where the room is small."""
        rng, size_m = self.rng(1), self.plan.size_m
        places = count if size_m[0] * size_m[1] > 18 else count // 2
        found, apart = [], 0.5
        boxes = [p.box for p in self.plan.pieces if p.box.center[2] - p.box.size[2] / 2 < 1.4]
        for tries in range(40000):
            if len(found) == places:
                break
            apart = 0.5 if tries < 20000 else 0.3
            p = np.array([rng.uniform(0.45, size_m[0] - 0.45), rng.uniform(0.45, size_m[1] - 0.45),
                          rng.uniform(0.9, 1.35)])
            if all(np.hypot(*(p - q)[:2]) > apart for q in found) and all(
                    rooms.footprint_distance(b, p)[0] > 0.4 for b in boxes):
                found.append(p)
        self.places = len(found)
        return np.array([found[i % len(found)] for i in range(count)])

    def _stations(self, spots):
        rng, count = self.rng(4), len(spots)
        off = np.array([slow(rng, count, s) for s in (POSE_M, POSE_M, POSE_M / 2)]).T * self.has("pose_drift")
        off_deg = np.array([slow(rng, count, s) for s in (HEADING_DEG / 3, HEADING_DEG / 3, HEADING_DEG)]).T
        off_deg *= self.has("pose_drift")
        mount = np.array([self.of("radar_position_offset", "forward_m"), self.of("radar_position_offset", "left_m"), 0])
        self.stations, clock = [], 1761000000.0
        first = rng.uniform(0, 2 * np.pi, self.places)
        for i, spot in enumerate(spots):
            yaw = first[i % self.places] + np.pi * (i // self.places) + rng.normal(0, 0.3)
            held = turn(2, yaw) @ turn(1, math.radians(rng.normal(0, 0.3))) @ turn(0, math.radians(rng.normal(0, 0.3)))
            error = turn(2, math.radians(off_deg[i, 2])) @ turn(1, math.radians(off_deg[i, 1]))
            reported = Pose(spot - off[i], held @ error.T)
            true = Pose(spot + held @ mount, held @ turn(2, math.radians(self.of("radar_yaw_offset", "yaw_deg"))))
            self.stations.append(Station(f"{i + 1:03d}", f"{i % self.places + 1:02d}", round(clock * 1000) * 1000000,
                                         true, reported))
            clock += rng.uniform(35, 60)

    def _build(self):
        """The true room; what is described stands in described_actors and described_materials."""
        rng, plan = self.rng(5), self.plan
        nature = Nature(Nature.waviness_m * self.has("waviness"), Nature.waviness_length_m,
                        Nature.unevenness_db * self.has("unevenness"), Nature.unevenness_length_m,
                        self.has("roughness"))
        frequency_hz = C / Front().wavelength_m
        self.matter = {tag: Matter(None if eps is None else eps - 1j * s / (2 * math.pi * frequency_hz * EPSILON_0),
                                   share * self.has("scattering"))
                       for tag, (eps, s, share) in rooms.TAGS.items()}
        wrong = rng.normal(0, WALL_M, 4) * self.has("places")
        low, high = np.array([wrong[0], wrong[1]]), plan.size_m[:2] + wrong[2:]
        lx, ly, lz = *(high - low), plan.size_m[2]
        z = (0, 0, 1)
        sides = {"wall_south": ((*low, 0), z, (1, 0, 0), lz, lx),
                 "wall_north": ((low[0], high[1], 0), (1, 0, 0), z, lx, lz),
                 "wall_west": ((*low, 0), (0, 1, 0), z, ly, lz), "wall_east": ((high[0], low[1], 0), z, (0, 1, 0), lz, ly)}
        faces = [self._face(name, tag, sides[name], nature, 0) for name, tag in plan.walls.items()]
        names = list(plan.walls)
        boxes = []
        for piece in plan.pieces:
            own = np.random.default_rng([self.seed, 6, *piece.name.encode()])
            shift = own.normal(0, SCENE_M, 3) * [1, 1, 0] * self.has("places")
            lean = math.radians(own.normal(0, TURN_DEG)) * self.has("places")
            if self.of("actor_absent", "actor", None) == piece.name:
                continue
            if self.of("actor_moved", "actor", None) == piece.name:
                shift = shift + [self.hidden["dx_m"], self.hidden["dy_m"], 0]
                lean += math.radians(self.hidden["dyaw_deg"])
            box = Box(piece.box.center + shift, piece.box.size, piece.box.yaw_rad + lean)
            boxes.append(box)
            faces += [self._face(piece.name, piece.tag, side, nature, i) for i, side in enumerate(box.sides())]
            names += [piece.name] * (len(faces) - len(names))
        if self.cause == "actor_unmodelled":
            size, height = self.hidden["size_m"], hidden.UNMODELLED_HEIGHT_M
            box = Box(np.array([self.hidden["x_m"], self.hidden["y_m"], 0.01 + height / 2]), np.array([size, size, height]),
                      math.radians(self.hidden["yaw_deg"]))
            boxes.append(box)
            faces += [self._face("object", "Metal", side, nature, i) for i, side in enumerate(box.sides())]
        things = rooms.draw_things(self.rng(7), plan, self.has("rods") > 0, self.has("things") > 0)
        ripple = self.has("ripple")
        self.front = Front(ripple_db=Front.ripple_db * ripple, own_ripple_db=Front.own_ripple_db * ripple,
                           own_ripple_deg=Front.own_ripple_deg * ripple, seed=self.seed,
                           cos_exponent=self.of("element_pattern", "cos_exponent"),
                           pitch_scale=self.of("carrier_scale", "scale"))
        self.faces_of = {}
        for i, name in enumerate(names):
            self.faces_of.setdefault(name, set()).add(i)
        self.world = World(faces, boxes, [Wire(*t) for t in things], self.front)
        self._describe()

    def _face(self, name, tag, side, nature, number):
        rng = np.random.default_rng([self.seed, 8, number, *name.encode()])
        face = Face(name, self.matter[tag], *side, rng, nature)
        actor_db = np.random.default_rng([self.seed, 9, *name.encode()]).normal(0, LEVEL_DB) * self.has("levels")
        if self.of("material_reflectivity", "material", None) == tag:
            actor_db += self.hidden["delta_db"]
        face.level_db = face.level_db - face.level_db.mean() + actor_db
        if face.matter.permittivity is None and not (self.cause == "material_reflectivity"):
            face.level_db = np.minimum(face.level_db, 0.0)
        return face

    def _describe(self):
        plan = self.plan
        lx, ly, lz = plan.size_m
        sides = {"wall_south": ((0, 0, 0), (0, 0, lz), (lx, 0, 0)), "wall_north": ((0, ly, 0), (lx, 0, 0), (0, 0, lz)),
                 "wall_west": ((0, 0, 0), (0, ly, 0), (0, 0, lz)), "wall_east": ((lx, 0, 0), (0, 0, lz), (0, ly, 0))}
        self.described_actors = [
            geometry.Actor("floor", "Carpet", [geometry.sheet((0, 0, 0), (lx, 0, 0), (0, ly, 0))], shell=True),
            geometry.Actor("ceiling", "Plaster", [geometry.sheet((0, 0, lz), (0, ly, 0), (lx, 0, 0))], shell=True)]
        self.described_actors += [geometry.Actor(name, tag, [geometry.sheet(*sides[name])], shell=True)
                                  for name, tag in plan.walls.items()]
        self.described_actors += [
            geometry.Actor(p.name, p.tag, [geometry.box(p.box.center, p.box.size, math.degrees(p.box.yaw_rad))])
            for p in plan.pieces]
        used = set(plan.tags()) | {"Carpet", "Plaster"}
        self.described_materials = {
            tag: office.Material(conductor=True) if eps is None else
            office.Material(eps, s, scattering=share * self.has("scattering"))
            for tag, (eps, s, share) in rooms.TAGS.items() if tag in used}

    def described_mechanisms(self, *_):
        """The base model alone."""
        return None

    def grid(self, station):
        """[M, N] beat signals of one pose as they arrive: laws of range act on the delay axis."""
        pose = station.true
        if self.cause == "scene_registration":
            back = turn(2, -math.radians(self.hidden["yaw_deg"]))
            step = np.array([self.hidden["x_m"], self.hidden["y_m"], 0])
            pose = Pose(back @ (pose.position - step), back @ pose.rotation)
        profile = self.world.profile(pose.position, pose.rotation)
        length = np.arange(profile.shape[1]) * STEP_M
        profile = profile * on_grid(-self.of("excess_attenuation", "db_per_m") * length / 2)
        corner = self.of("if_highpass", "corner_hz")
        if corner:
            beat = np.maximum(self.front.slope * length / C, 1.0)
            one = corner * math.sqrt((math.sqrt(41.0) - 5) / 8)     # two sections an octave apart, -3 dB of both
            profile = profile / ((1 - 1j * one / beat) * (1 - 2j * one / beat))
        return profile @ self.front.beat(length + 2 * self.of("range_bias", "range_m"), self.of("range_scale", "scale"))

    def strongest(self, grids):
        """Amplitude of the session's strongest echo, rms over channels."""
        window = 0.5 * (1 - np.cos(2 * np.pi * np.arange(self.front.samples) / self.front.samples))
        peaks = []
        for x in grids:
            spectrum = np.fft.fft(x * window, 512, axis=1) / window.sum()
            peaks.append(np.sqrt(np.mean(np.abs(spectrum)**2, axis=0))[16:].max())
        return max(peaks)

    def receive(self, grids):
        """Grids after array, leakage, gain over time and images, at full scale 1 without compression."""
        rng, level, received = self.rng(10), self.strongest(grids), []
        vector = rng.standard_normal((2, 8)) + 1j * rng.standard_normal((2, 8))
        vector /= np.sqrt(np.mean(np.abs(vector)**2, axis=1))[:, None]
        image = self.images()
        gain_db = slow(rng, len(grids), 0.25) * self.has("gain_drift")
        hours = np.array([s.stamp_ns - self.stations[0].stamp_ns for s in self.stations]) / 3.6e12
        gain_db += self.of("gain_drift", "db_per_hour") * hours
        gain_db[len(grids) // 2:] += self.of("gain_drift", "steps_db", [0.0])[0]
        weights = np.ones(8, complex)
        weights[4:] *= on_grid(self.of("tx_imbalance", "gain_db")) * np.exp(
            1j * math.radians(self.of("tx_imbalance", "phase_deg")))
        weights *= on_grid(np.array(self.of("channel_phase_error", "gain_db", [0] * 8))) * np.exp(
            1j * np.radians(self.of("channel_phase_error", "phase_deg", [0] * 8)))
        for i, x in enumerate(grids):
            x = x * weights[:, None]
            if self.cause == "tx_rx_leakage":
                x = x + level * on_grid(self.hidden["level_db"]) * np.outer(
                    vector[0], self.front.beat(np.array([2 * self.hidden["range_m"]])))
            if self.cause == "dc_offset":
                x = x + level * on_grid(self.hidden["level_db"]) * vector[1][:, None]
            x = x * on_grid(gain_db[i])
            received.append(x + np.tile(image, 2)[:, None] * np.conj(x))
        return received

    def samples(self, index, x, gain):
        """int16 samples of all frames of one pose, as the capture card writes them."""
        rng = self.rng(11, index)
        cube = np.broadcast_to((gain * x).reshape(2, 4, -1).transpose(0, 2, 1), (FRAMES, 2, x.shape[1], 4))
        both = np.stack([cube.real, cube.imag], axis=3)      # frame, slot, sample, I and Q, receiver
        both = both + gain * NOISE_RMS / math.sqrt(2) * rng.standard_normal(both.shape)
        both = both * (1 - 0.1 * self.has("compression") * both**2)     # 0.1 dB at PEAK
        return np.clip(np.rint(both * 32768), -32768, 32767).astype("<i2")

    def write(self, directory):
        """Writes the session's folder."""
        os.makedirs(os.path.join(directory, "captures"), exist_ok=True)
        received = self.receive([self.grid(s) for s in self.stations])
        peak = max(max(np.abs(x.real).max(), np.abs(x.imag).max()) for x in received)
        for i, (station, x) in enumerate(zip(self.stations, received)):
            with open(os.path.join(directory, "captures", f"{station.name}.bin"), "wb") as out:
                out.write(self.samples(i, x, PEAK / peak).tobytes())
        session.write_description(directory, self)
        with open(os.path.join(directory, "session.yaml"), "a", encoding="ascii") as out:
            out.write(STATED)

    def corner_over_noise_db(self, actors):
        """[stations] level of the ways over two faces of one or two actors, over the noise of a sample; -99 where there
        are none."""
        first, second = self.faces_of.get(actors[0], set()), self.faces_of.get(actors[-1], set())
        levels = [self.world.corner(s.true.position, s.true.rotation, first, second) for s in self.stations]
        return [20 * math.log10(max(a / NOISE_RMS, 1e-5)) for a in levels]

    def images(self):
        """[4] complex shares of the conjugate signal that receivers add, the hidden cause's among them."""
        rng = self.rng(13)
        image = 10**(rng.normal(-35, 2, 4) / 20) * np.exp(2j * np.pi * rng.random(4)) * self.has("images")
        if self.cause == "iq_imbalance":
            image = image + on_grid(self.hidden["image_db"]) * np.exp(2j * np.pi * rng.random())
        return image

    def truth(self):
        """[{"cause", "parameters"}], empty where nothing is hidden."""
        return [{"cause": self.cause, "parameters": self.hidden}] if self.cause else []
