"""Effects outside the catalogue of causes, for tests that must end in `unknown`, and decoys that look like a material.

`variable` is what the law depends on; truth() names it, and the place in map where there is one.
"""
import math

import numpy as np

from mmradartwin_tests.campaign import rotation_from_vector
from mmradartwin_tests.effects.effect import Effect, uncatalogued
from mmradartwin_tests.effects.objects import free_spot
from mmradartwin_tests.tracing import Path


class EchoLaw(Effect):
    """Multiplies every echo by a complex factor of its directions, length and size."""
    variable = ""

    def factor(self, measurement, station, departure, arrival, length_m, size):
        """[P] from unit directions [P, 3] in radar_link, lengths [P] and |coefficients| [P]."""
        return np.ones(len(length_m))

    def echoes(self, measurement, station, echoes):
        if len(echoes.paths):
            legs = path_directions(station, echoes.paths)
            factor = self.factor(measurement, station, *legs, echoes.lengths_m[:, 0], np.abs(echoes.coefficients))
            echoes.coefficients = echoes.coefficients * factor
        ray = scatter_directions(station, echoes.scatter)
        echoes.scatter_coefficients = echoes.scatter_coefficients * self.factor(
            measurement, station, ray, ray, echoes.scatter.lengths_m[:, 0], np.abs(echoes.scatter_coefficients))

    def truth(self, measurement):
        return {**self.p, "variable": self.variable}


def along_session(measurement, station):
    """When a pose was taken, 0 for the first and 1 for the last."""
    first, last = measurement.stations[0].stamp_ns, measurement.stations[-1].stamp_ns
    return (station.stamp_ns - first) / max(1, last - first)


def path_directions(station, paths):
    """Departures and arrivals, [P, 3] each, unit vectors in radar_link."""
    return [station.true.to_radar(np.array([getattr(p, side) for p in paths])) for side in ("departure", "arrival")]


def scatter_directions(station, scatter):
    """[S, 3] unit vectors in radar_link."""
    ray = scatter.points - station.true.position
    return station.true.to_radar(ray / np.linalg.norm(ray, axis=1)[:, None])


def azimuth(directions):
    """Azimuth of unit directions in radar_link, rad."""
    return np.arctan2(directions[:, 1], directions[:, 0])


def delayed_copies(echoes, which, delay_m, factor):
    """Paths like those of `which` (indices), delay_m of one-way range later and `factor` times as strong."""
    copies = []
    for i in which:
        p, lengths = echoes.paths[i], echoes.lengths_m[i] + 2 * delay_m
        copies.append(Path(p.event, p.facets, p.actors, p.vertices, p.departure, p.arrival, p.length_m + 2 * delay_m,
                           complex(np.conj(echoes.coefficients[i] * factor)), lengths, p.cosines))
    return copies


@uncatalogued
class RadomeRipple(EchoLaw):
    """A cover in front of the antenna: level and phase ripple over the azimuth, both legs."""
    name, main, variable = "radome_ripple", "ripple_db", "azimuth"
    defaults = {"ripple_db": 2.0, "ripple_deg": 15.0, "period_sine": 0.35}

    def scale(self, strength):
        self.p["ripple_db"] *= strength
        self.p["ripple_deg"] *= strength

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
class LevelByTotalPower(EchoLaw):
    """An amplifier gives way, or a control turns it down: a pose's level falls by so many dB for each dB of power that
    the pose receives in all."""
    name, main, variable = "level_by_total_power", "db_per_db", "total_power_db"
    defaults = {"db_per_db": -0.4, "reference_db": -85.0}

    def echoes(self, measurement, station, echoes):
        power = np.sum(np.abs(echoes.coefficients)**2) + np.sum(np.abs(echoes.scatter_coefficients)**2)
        above_db = 10 * math.log10(power) - self.p["reference_db"]
        self.by = 10**(self.p["db_per_db"] * above_db / 20)
        super().echoes(measurement, station, echoes)

    def factor(self, measurement, station, departure, arrival, length_m, size):
        return np.full(len(length_m), self.by)


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
class StandingField(EchoLaw):
    """Level comes and goes with where the radar stands, as in another transmitter's standing wave."""
    name, main, variable = "standing_field", "swing_db", "where the radar stands"
    defaults = {"swing_db": 4.0, "period_m": 2.4, "toward_deg": 35.0}

    def factor(self, measurement, station, departure, arrival, length_m, size):
        toward = math.radians(self.p["toward_deg"])
        along_m = station.true.position[:2] @ np.array([math.cos(toward), math.sin(toward)])
        swing_db = self.p["swing_db"] * math.sin(2 * math.pi * along_m / self.p["period_m"])
        return np.full(len(length_m), 10**(swing_db / 20))


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
class RangeBump(EchoLaw):
    """Level rises and falls over a stretch of range (a filter that is not as flat as drawn): a parabola, 0 outside."""
    name, main, variable = "range_bump", "bump_db", "range"
    defaults = {"bump_db": 5.0, "center_m": 3.2, "half_width_m": 1.8}

    def factor(self, measurement, station, departure, arrival, length_m, size):
        away = (length_m / 2 - self.p["center_m"]) / self.p["half_width_m"]
        return 10**(self.p["bump_db"] * np.maximum(0, 1 - away**2) / 20)


@uncatalogued
class IncidenceGain(Effect):
    """Surfaces return more at oblique incidence than any dielectric does, after the angle at the first of them."""
    name, main = "incidence_gain", "rise_db"
    defaults = {"rise_db": 8.0}

    def factor(self, cosine):
        """Of cosines of incidence [P]: rise_db times sin^2."""
        return 10**(self.p["rise_db"] * (1 - np.clip(np.abs(cosine), 0, 1)**2) / 20)

    def echoes(self, measurement, station, echoes):
        if len(echoes.paths):
            echoes.coefficients = echoes.coefficients * self.factor(np.array([p.cosines[0] for p in echoes.paths]))
        ray = echoes.scatter.points - station.true.position
        ray /= np.linalg.norm(ray, axis=1)[:, None]
        cosine = np.sum(ray * measurement.room.normal[echoes.scatter.facet], axis=1)
        echoes.scatter_coefficients = echoes.scatter_coefficients * self.factor(cosine)

    def truth(self, measurement):
        return {**self.p, "variable": "incidence"}


class DelayLaw(Effect):
    """Lengthens every echo's one-way range by a law."""
    variable = ""

    def shift_m(self, measurement, station, azimuth_rad):
        """[P] from azimuths [P] in radar_link, the mean of departure and arrival."""
        return np.zeros(len(azimuth_rad))

    def echoes(self, measurement, station, echoes):
        if len(echoes.paths):
            legs = [azimuth(d) for d in path_directions(station, echoes.paths)]
            echoes.lengths_m = echoes.lengths_m + 2 * self.shift_m(measurement, station, sum(legs) / 2)[:, None]
        ray = station.true.to_radar(echoes.scatter.points - station.true.position)
        shift = self.shift_m(measurement, station, azimuth(ray))
        echoes.scatter.lengths_m = echoes.scatter.lengths_m + 2 * shift[:, None]

    def truth(self, measurement):
        return {**self.p, "variable": self.variable}


@uncatalogued
class LensDelay(DelayLaw):
    """A cover that is thicker to the sides: range grows with the azimuth."""
    name, main, variable = "lens_delay", "side_m", "azimuth"
    defaults = {"side_m": 0.10}

    def shift_m(self, measurement, station, azimuth_rad):
        return self.p["side_m"] * np.sin(azimuth_rad)**2


@uncatalogued
class DelayCreep(DelayLaw):
    """Range creeps while the campaign lasts."""
    name, main, variable = "delay_creep", "total_m", "time"
    defaults = {"total_m": 0.12}

    def shift_m(self, measurement, station, azimuth_rad):
        return np.full(len(azimuth_rad), self.p["total_m"] * along_session(measurement, station))


@uncatalogued
class WarmUpSquint(Effect):
    """The array looks to the side when the campaign begins and settles: echoes seem to come from elsewhere."""
    name, main = "warm_up_squint", "squint_deg"
    defaults = {"squint_deg": 4.0, "share_of_session": 0.25}

    def turned(self, measurement, station, lengths_m, departure, arrival):
        """Lengths [P, M] as of directions [P, 3] in radar_link that are turned to the left."""
        along = along_session(measurement, station) / self.p["share_of_session"]
        turn = rotation_from_vector([0, 0, math.radians(self.p["squint_deg"]) * math.exp(-along)])
        of_tx = (departure - departure @ turn.T) @ measurement.radar.tx.T
        of_rx = (arrival - arrival @ turn.T) @ measurement.radar.rx.T
        return lengths_m + (of_tx[:, :, None] + of_rx[:, None, :]).reshape(len(lengths_m), -1)

    def echoes(self, measurement, station, echoes):
        if len(echoes.paths):
            legs = path_directions(station, echoes.paths)
            echoes.lengths_m = self.turned(measurement, station, echoes.lengths_m, *legs)
        ray = scatter_directions(station, echoes.scatter)
        echoes.scatter.lengths_m = self.turned(measurement, station, echoes.scatter.lengths_m, ray, ray)

    def truth(self, measurement):
        return {**self.p, "variable": "time"}


@uncatalogued
class TransmitterSkew(Effect):
    """The second transmitter's phase slips against the first one's with the delay."""
    name, main = "transmitter_skew", "deg_per_m"
    defaults = {"deg_per_m": 15.0}

    def echoes(self, measurement, station, echoes):
        radar = measurement.radar
        receivers = len(radar.rx)

        def skewed(lengths_m):
            slip_m = radar.wavelength_m * self.p["deg_per_m"] / 360 * lengths_m[:, :1] / 2
            slot = np.arange(lengths_m.shape[1]) // receivers
            return lengths_m + slip_m * (slot == 1)

        if len(echoes.paths):
            echoes.lengths_m = skewed(echoes.lengths_m)
        echoes.scatter.lengths_m = skewed(echoes.scatter.lengths_m)

    def truth(self, measurement):
        return {**self.p, "variable": "range"}


@uncatalogued
class DryingWall(Effect):
    """One wall returns more and more while the campaign lasts."""
    name, main = "drying_wall", "rise_db"
    defaults = {"actor": None, "rise_db": 10.0}

    def prepare(self, measurement):
        walls = ["wall_north", "wall_south", "wall_east", "wall_west"]
        self.p["actor"] = self.p["actor"] or str(measurement.rng(163).choice(walls))
        self.index = measurement.described_room.actor_index(self.p["actor"])

    def echoes(self, measurement, station, echoes):
        factor = 10**(self.p["rise_db"] * (along_session(measurement, station) - 0.5) / 20)
        met = np.array([self.index in p.actors for p in echoes.paths], bool)
        echoes.coefficients = echoes.coefficients * np.where(met, factor, 1)
        echoes.scatter_coefficients = echoes.scatter_coefficients * np.where(
            echoes.scatter.actor == self.index, factor, 1)

    def truth(self, measurement):
        return {**self.p, "variable": "time"}


@uncatalogued
class LayeredPanel(Effect):
    """An actor is hollow: behind its face a second one returns, so that its reflectivity changes over the band."""
    name, main = "layered_panel", "level"
    defaults = {"actor": None, "depth_m": 0.09, "level": 0.7}

    def prepare(self, measurement):
        rng = measurement.rng(161)
        self.p["actor"] = self.p["actor"] or str(rng.choice(["wall_east", "wall_west", "bookshelf", "wardrobe"]))
        self.index = measurement.described_room.actor_index(self.p["actor"])
        self.turn = np.exp(2j * np.pi * rng.random())

    def echoes(self, measurement, station, echoes):
        hit = [i for i, p in enumerate(echoes.paths) if self.index in p.actors]
        echoes.add(delayed_copies(echoes, hit, self.p["depth_m"], self.turn * self.p["level"]))

    def truth(self, measurement):
        x_m, y_m = measurement.described_actors[self.index].centroid()[:2]
        return {**self.p, "variable": "actor", "x_m": float(x_m), "y_m": float(y_m)}


@uncatalogued
class TiltedPanel(Effect):
    """A decoy: a flat thing on a wall hangs forward, and its specular point is lower than thought or off its face."""
    name, main = "tilted_panel", "tilt_deg"
    defaults = {"actor": "tv", "tilt_deg": 4.0}

    def room(self, measurement, actors, materials):
        return [self.tilted(a) if a.name == self.p["actor"] else a for a in actors], materials

    def prepare(self, measurement):
        measurement.described_room.actor_index(self.p["actor"])

    def tilted(self, actor):
        """Turned about its lower edge at the wall, the top into the room."""
        (part,) = actor.parts
        thin = int(np.argmin(part.size[:2]))
        inward = part.rotation[:, thin] * np.sign(part.rotation[:, thin] @ (np.array([4.0, 3.0, 0]) - part.center))
        hinge = part.center - 0.5 * part.size[2] * np.array([0, 0, 1]) - 0.5 * part.size[thin] * inward
        turn = rotation_from_vector(math.radians(self.p["tilt_deg"]) * np.cross([0, 0, 1], inward))
        return actor.moved(turn, np.zeros(3), hinge)

    def truth(self, measurement):
        return {**self.p, "variable": "actor"}


@uncatalogued
class TrailingEcho(Effect):
    """Every echo is followed by a weaker copy of itself (a mismatch in the signal path)."""
    name, main, rank = "trailing_echo", "level_db", 1
    defaults = {"level_db": -12.0, "delay_m": 0.62}

    def prepare(self, measurement):
        self.turn = np.exp(2j * np.pi * measurement.rng(160).random())

    def echoes(self, measurement, station, echoes):
        factor = self.turn * 10**(self.p["level_db"] / 20)
        echoes.add(delayed_copies(echoes, range(len(echoes.paths)), self.p["delay_m"], factor))

    def truth(self, measurement):
        return {**self.p, "variable": "range behind an echo"}


@uncatalogued
class LateTag(Effect):
    """A small tag answers all directions alike, after a delay line."""
    name, main = "late_tag", "rcs_m2"
    defaults = {"x_m": None, "y_m": None, "height_m": 1.2, "rcs_m2": 0.6, "late_m": 1.3}

    def prepare(self, measurement):
        if self.p["x_m"] is None or self.p["y_m"] is None:
            self.p["x_m"], self.p["y_m"] = free_spot(measurement, 0.3, 162)

    def echoes(self, measurement, station, echoes):
        point = np.array([self.p["x_m"], self.p["y_m"], self.p["height_m"]])
        away = point - station.true.position
        distance = float(np.linalg.norm(away))
        if not station.true.sees(away / distance)[0] or not measurement.room.visible(station.true.position, point)[0]:
            return
        # Radar equation: received over sent power is sigma lambda^2 / ((4 pi)^3 r^4).
        wavelength = measurement.radar.wavelength_m
        level = math.sqrt(self.p["rcs_m2"] / (4 * math.pi)) * wavelength / (4 * math.pi * distance**2)
        lengths = measurement.tracer.point_lengths(station.true, point[None])[0] + 2 * self.p["late_m"]
        ray = away / distance
        echoes.add([Path("tag", (), (), point[None], ray, ray, 2 * (distance + self.p["late_m"]),
                         complex(level), lengths, ())])

    def truth(self, measurement):
        return {**self.p, "variable": "range behind a place"}


@uncatalogued
class SlotCrosstalk(Effect):
    """The transmitter that should rest radiates a little in the other's slot."""
    name, main, rank = "slot_crosstalk", "level_db", 2
    defaults = {"level_db": -10.0, "phase_deg": 40.0}

    def receive(self, measurement, index, station, x):
        slots = x.reshape(len(measurement.radar.tx), len(measurement.radar.rx), -1)
        leak = 10**(self.p["level_db"] / 20) * np.exp(1j * math.radians(self.p["phase_deg"]))
        return (slots + leak * (slots.sum(axis=0) - slots)).reshape(x.shape)

    def truth(self, measurement):
        return {**self.p, "variable": "transmitter"}


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
class TwoStates(Effect):
    """A synthesiser that locks in two ways by turns: every second frame is weaker and comes later."""
    name, main, rank = "two_states", "loss_db", 2
    defaults = {"loss_db": 4.0, "late_m": 0.4}

    def scale(self, strength):
        for key in self.defaults:
            self.p[key] *= strength

    def frames(self, measurement, index, station, frames, rng):
        radar = measurement.radar
        t = np.arange(radar.samples) / radar.sample_rate_hz
        other = 10**(-self.p["loss_db"] / 20) * np.exp(2j * np.pi * measurement.beat_hz(2 * self.p["late_m"]) * t)
        return np.where((np.arange(len(frames)) % 2)[:, None, None] > 0, other, 1) * np.asarray(frames)

    def truth(self, measurement):
        return {**self.p, "variable": "frame"}


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
