"""Effects outside the catalogue of causes, for tests that must end in `unknown`, and decoys that look like a material.

`variable` is what the law depends on; truth() names it, and the place in map where there is one.
"""
import math

import numpy as np

from mmradartwin_tests.effects.effect import Effect, uncatalogued
from mmradartwin_tests.tracing import Path


class EchoLaw(Effect):
    """Multiplies every echo by a complex factor of its directions, length and size."""
    variable = ""

    def factor(self, measurement, station, departure, arrival, length_m, size):
        """[P] from unit directions [P, 3] in radar_link, lengths [P] and |coefficients| [P]."""
        return np.ones(len(length_m))

    def echoes(self, measurement, station, echoes):
        if len(echoes.paths):
            legs = [station.true.to_radar(np.array([getattr(p, side) for p in echoes.paths]))
                    for side in ("departure", "arrival")]
            factor = self.factor(measurement, station, *legs, echoes.lengths_m[:, 0], np.abs(echoes.coefficients))
            echoes.coefficients = echoes.coefficients * factor
        ray = echoes.scatter.points - station.true.position
        ray = station.true.to_radar(ray / np.linalg.norm(ray, axis=1)[:, None])
        echoes.scatter_coefficients = echoes.scatter_coefficients * self.factor(
            measurement, station, ray, ray, echoes.scatter.lengths_m[:, 0], np.abs(echoes.scatter_coefficients))

    def truth(self, measurement):
        return {**self.p, "variable": self.variable}


def azimuth(directions):
    """Azimuth of unit directions in radar_link, rad."""
    return np.arctan2(directions[:, 1], directions[:, 0])


@uncatalogued
class RadomeRipple(EchoLaw):
    """A cover in front of the antenna: level and phase ripple over the azimuth, both legs."""
    name, main, variable = "radome_ripple", "ripple_db", "azimuth"
    defaults = {"ripple_db": 2.0, "ripple_deg": 15.0, "period_sine": 0.35}

    def factor(self, measurement, station, departure, arrival, length_m, size):
        total = 0
        for d in (departure, arrival):
            turn = 2 * np.pi * np.sin(azimuth(d)) / self.p["period_sine"]
            total = total + self.p["ripple_db"] / 8.686 * np.cos(turn)
            total = total + 1j * math.radians(self.p["ripple_deg"]) * np.sin(turn)
        return np.exp(total)


@uncatalogued
class BracketShadow(EchoLaw):
    """Part of the mount hides a sector of the view."""
    name, main, variable = "bracket_shadow", "loss_db", "azimuth"
    defaults = {"loss_db": 6.0, "from_deg": 18.0, "to_deg": 40.0}

    def factor(self, measurement, station, departure, arrival, length_m, size):
        total = 0
        for d in (departure, arrival):
            angle = np.degrees(azimuth(d))
            total = total + ((angle > self.p["from_deg"]) & (angle < self.p["to_deg"]))
        return 10**(-self.p["loss_db"] * total / 20)


@uncatalogued
class RangeRipple(EchoLaw):
    """Standing wave in the receiver: level ripples with range."""
    name, main, variable = "range_ripple", "ripple_db", "range"
    defaults = {"ripple_db": 3.0, "period_m": 1.7}

    def factor(self, measurement, station, departure, arrival, length_m, size):
        return 10**(self.p["ripple_db"] * np.sin(np.pi * length_m / self.p["period_m"]) / 20)


@uncatalogued
class Compression(EchoLaw):
    """Strong echoes come out weaker: A / (1 + A / A0)."""
    name, main, variable = "compression", "strength", "echo amplitude"
    defaults = {"strength": 1.0, "reference": 4e-5}

    def factor(self, measurement, station, departure, arrival, length_m, size):
        return 1 / (1 + self.p["strength"] * size / self.p["reference"])


@uncatalogued
class HeightGain(EchoLaw):
    """Level depends on the height of the radar."""
    name, main, variable = "height_gain", "db_per_m", "radar height"
    defaults = {"db_per_m": 12.0}

    def factor(self, measurement, station, departure, arrival, length_m, size):
        return np.full(len(length_m), 10**(self.p["db_per_m"] * (station.true.position[2] - 1.1) / 20))


@uncatalogued
class CompassGain(EchoLaw):
    """Level depends on the direction of the echo in the room, wherever the radar stands."""
    name, main, variable = "compass_gain", "swing_db", "world direction"
    defaults = {"swing_db": 3.0, "toward_deg": 60.0}

    def factor(self, measurement, station, departure, arrival, length_m, size):
        world = arrival @ station.true.rotation.T
        away = np.arctan2(world[:, 1], world[:, 0]) - math.radians(self.p["toward_deg"])
        return 10**(self.p["swing_db"] * np.cos(away) / 20)


@uncatalogued
class DampSpot(EchoLaw):
    """An absorbing place in the room: paths that pass near a point of the floor plan lose power."""
    name, main, variable = "damp_spot", "loss_db", "place"
    defaults = {"x_m": 4.8, "y_m": 2.0, "radius_m": 0.7, "loss_db": 8.0}

    def share(self, a, b):
        """[P] how deep segments a-b (in plan) pass into the spot, 0 to 1."""
        a, b, c = a[:, :2], b[:, :2], np.array([self.p["x_m"], self.p["y_m"]])
        d = b - a
        t = np.clip(np.sum((c - a) * d, axis=1) / np.maximum(np.sum(d * d, axis=1), 1e-12), 0, 1)
        miss = np.linalg.norm(a + t[:, None] * d - c, axis=1)
        return np.exp(-0.5 * (miss / (self.p["radius_m"] / 2))**2)

    def echoes(self, measurement, station, echoes):
        p = station.true.position
        loss = []
        for path in echoes.paths:
            chain = np.concatenate([[p], path.vertices, [p]])
            loss.append(self.share(chain[:-1], chain[1:]).sum() / 2)
        echoes.coefficients = echoes.coefficients * 10**(-self.p["loss_db"] * np.array(loss) / 20)
        points = echoes.scatter.points
        echoes.scatter_coefficients = echoes.scatter_coefficients * 10**(
            -self.p["loss_db"] * self.share(np.broadcast_to(p, points.shape), points) / 20)


@uncatalogued
class TrailingEcho(Effect):
    """Every echo is followed by a weaker copy of itself (a mismatch in the signal path)."""
    name, main, rank = "trailing_echo", "level_db", 1
    defaults = {"level_db": -12.0, "delay_m": 0.62}

    def prepare(self, measurement):
        self.turn = np.exp(2j * np.pi * measurement.rng(160).random())

    def echoes(self, measurement, station, echoes):
        copies = [Path(p.event, p.facets, p.actors, p.vertices, p.departure, p.arrival,
                       p.length_m + 2 * self.p["delay_m"],
                       complex(np.conj(c * self.turn * 10**(self.p["level_db"] / 20))),
                       lengths + 2 * self.p["delay_m"], p.cosines)
                  for p, c, lengths in zip(echoes.paths, echoes.coefficients, echoes.lengths_m)]
        echoes.add(copies)

    def truth(self, measurement):
        return {**self.p, "variable": "range behind an echo"}


@uncatalogued
class MutualCoupling(Effect):
    """Each receiver leaks into its neighbours."""
    name, main, rank = "mutual_coupling", "level_db", 2
    defaults = {"level_db": -14.0, "phase_deg": 70.0}

    def receive(self, measurement, index, station, x):
        receivers = len(measurement.radar.rx)
        leak = 10**(self.p["level_db"] / 20) * np.exp(1j * math.radians(self.p["phase_deg"]))
        c = np.eye(receivers) + leak * (np.eye(receivers, k=1) + np.eye(receivers, k=-1))
        return np.concatenate([c @ x[k:k + receivers] for k in range(0, len(x), receivers)])

    def truth(self, measurement):
        return {**self.p, "variable": "channel"}


@uncatalogued
class FrequencySpur(Effect):
    """A clock's tone at a fixed beat frequency, in every frame with another phase."""
    name, main, rank = "frequency_spur", "level_db", 2
    defaults = {"level_db": 0.0, "beat_hz": 2.31e6}

    def frames(self, measurement, index, station, frames, rng):
        radar = measurement.radar
        t = np.arange(radar.samples) / radar.sample_rate_hz
        phase = np.exp(2j * np.pi * rng.random((len(frames), 1, 1)))
        level = measurement.strongest * 10**(self.p["level_db"] / 20)
        return np.asarray(frames) + level * phase * np.exp(2j * np.pi * self.p["beat_hz"] * t)

    def truth(self, measurement):
        return {**self.p, "variable": "frame and beat frequency"}


@uncatalogued
class WindowMismatch(Effect):
    """Fast time is tapered before it is recorded: a decoy that lowers and widens every echo."""
    name, main, rank = "window_mismatch", "depth", 2
    defaults = {"depth": 0.5}

    def receive(self, measurement, index, station, x):
        n = np.arange(x.shape[1])
        return x * (1 - self.p["depth"] * (0.5 + 0.5 * np.cos(2 * np.pi * n / len(n))))

    def truth(self, measurement):
        return {**self.p, "variable": "fast time"}


@uncatalogued
class SlowStart(Effect):
    """The first frames of every pose are weak: the transmitter warms up."""
    name, main, rank = "slow_start", "loss_db", 2
    defaults = {"loss_db": 10.0, "frames": 15.0}

    def frames(self, measurement, index, station, frames, rng):
        gain = 10**(-self.p["loss_db"] * np.exp(-np.arange(len(frames)) / self.p["frames"]) / 20)
        return np.asarray(frames) * gain[:, None, None]

    def truth(self, measurement):
        return {**self.p, "variable": "frame"}
