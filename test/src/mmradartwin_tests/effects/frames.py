"""Effects within and between the frames of one pose, and in the bytes of a capture."""
import math

import numpy as np

from mmradartwin_tests.effects.effect import Effect, effect
from mmradartwin_tests.effects.objects import free_spot

PACKET_BYTES = 1456
CHIRP_PERIOD_S = 60e-6


@effect
class MovingTarget(Effect):
    """Someone who walks to and fro along a line about (x_m, y_m), with a fluctuating echo, during the whole session."""
    name, main = "moving_target", "rcs_dbsm"
    defaults = {"x_m": None, "y_m": None, "speed_m_per_s": 0.5, "rcs_dbsm": 0.0, "reach_m": 0.3, "height_m": 1.1}

    def scale(self, strength):
        self.p["rcs_dbsm"] += 20 * math.log10(strength)

    def prepare(self, measurement):
        if self.p["x_m"] is None or self.p["y_m"] is None:
            self.p["x_m"], self.p["y_m"] = free_spot(measurement, 0.35, 140)
        self.heading = measurement.rng(141).uniform(0, 2 * math.pi)

    def frames(self, measurement, index, station, frames, rng):
        radar, p, pose = measurement.radar, self.p, station.true
        center = np.array([p["x_m"], p["y_m"], p["height_m"]])
        ray = center - pose.position
        if not pose.sees(ray / np.linalg.norm(ray))[0] or not measurement.room.visible(pose.position, center)[0]:
            return frames
        count = len(frames)
        slot = np.arange(len(radar.tx)) * CHIRP_PERIOD_S
        time = np.arange(count)[:, None] * radar.frame_period_s + slot + rng.uniform(0, 100.0)
        # Triangle wave of the walker's place along his line.
        phase = (time * p["speed_m_per_s"] / (4 * p["reach_m"])) % 1.0
        along = p["reach_m"] * (4 * np.abs(phase - 0.5) - 1)
        place = center + along[..., None] * np.array([math.cos(self.heading), math.sin(self.heading), 0.0])
        tx = pose.to_map(radar.tx)
        rx = pose.to_map(radar.rx)
        out = np.linalg.norm(place - tx, axis=2)                                 # [F, T]
        back = np.linalg.norm(place[:, :, None, :] - rx, axis=3)                 # [F, T, R]
        lengths = (out[:, :, None] + back).reshape(count, -1)
        r = lengths.mean(axis=1) / 2
        sigma = 10**(p["rcs_dbsm"] / 10)
        level = radar.wavelength_m * math.sqrt(sigma) / ((4 * math.pi)**1.5 * r**2)
        # The echo of a moving body is that of new surfaces every few centimetres.
        keep = math.exp(-p["speed_m_per_s"] * radar.frame_period_s / 0.05)
        fading = np.empty(count, complex)
        draw = (rng.standard_normal(count) + 1j * rng.standard_normal(count)) / math.sqrt(2)
        fading[0] = draw[0]
        for f in range(1, count):
            fading[f] = keep * fading[f - 1] + math.sqrt(1 - keep**2) * draw[f]
        result = np.array(frames)
        for f in range(count):
            result[f] += radar.grid(lengths[f:f + 1], level[f:f + 1] * fading[f:f + 1])
        return result

    def truth(self, measurement):
        return {key: self.p[key] for key in ("x_m", "y_m", "speed_m_per_s")}


@effect
class Interference(Effect):
    """Another radar's chirps cross ours in some frames: short bursts, rank one over receivers, new for every chirp."""
    name, main = "interference", "frame_fraction"
    defaults = {"frame_fraction": 0.1, "level_db": 20.0, "slope_difference_hz_per_s": 1.5e12}

    def __init__(self, **parameters):
        super().__init__(**parameters)
        self.struck = self.seen = 0

    def frames(self, measurement, index, station, frames, rng):
        radar = measurement.radar
        result = np.array(frames)
        receivers = len(radar.rx)
        level = measurement.strongest * 10**(self.p["level_db"] / 20)
        t = np.arange(radar.samples) / radar.sample_rate_hz
        bearing = rng.uniform(-0.9, 0.9)
        steering = np.exp(-2j * math.pi * radar.rx[:, 1] * bearing / radar.wavelength_m)
        struck = np.flatnonzero(rng.random(len(frames)) < self.p["frame_fraction"])
        self.struck, self.seen = self.struck + len(struck), self.seen + len(frames)
        for f in struck:
            for slot in range(len(radar.tx)):
                crossing = rng.uniform(t[0], t[-1])
                offset = self.p["slope_difference_hz_per_s"] * (t - crossing)
                burst = np.where(np.abs(offset) < radar.sample_rate_hz / 2,
                                 np.exp(1j * (math.pi * offset * (t - crossing) + rng.uniform(0, 2 * math.pi))), 0)
                result[f, slot * receivers:(slot + 1) * receivers] += level * np.outer(steering, burst)
        return result

    def truth(self, measurement):
        # What came to pass, which is all that the recording can tell.
        return {"frame_fraction": self.struck / self.seen if self.seen else self.p["frame_fraction"]}


@effect
class PhaseDrift(Effect):
    """Every frame is turned against the one before by the same angle."""
    name, main, rank = "phase_drift", "rad_per_frame", 2
    defaults = {"rad_per_frame": 0.03}

    def frames(self, measurement, index, station, frames, rng):
        turn = np.exp(1j * self.p["rad_per_frame"] * np.arange(len(frames)))
        return np.asarray(frames) * turn[:, None, None]


@effect
class PacketLoss(Effect):
    """Lost packets of 1456 bytes, filled with zeros and not flagged."""
    name, main, rank = "packet_loss", "lost_fraction", 2
    defaults = {"lost_fraction": 0.03}

    def __init__(self, **parameters):
        super().__init__(**parameters)
        self.lost = self.sent = 0

    def payload(self, measurement, index, station, payload, rng):
        data = bytearray(payload)
        count = -(-len(data) // PACKET_BYTES)
        lost = np.flatnonzero(rng.random(count) < self.p["lost_fraction"])
        self.lost, self.sent = self.lost + len(lost), self.sent + count
        for packet in lost:
            start, stop = packet * PACKET_BYTES, min((packet + 1) * PACKET_BYTES, len(data))
            data[start:stop] = bytes(stop - start)
        return bytes(data)

    def truth(self, measurement):
        # What came to pass, which is all that the recording can tell.
        return {"lost_fraction": self.lost / self.sent if self.sent else self.p["lost_fraction"]}


@effect
class PacketMisalignment(Effect):
    """In one pose a packet was lost and not filled: what follows slips, and the recording runs on for as long."""
    name, rank = "packet_misalignment", 2
    defaults = {"pose": None}

    def prepare(self, measurement):
        names = [s.name for s in measurement.stations]
        if isinstance(self.p["pose"], float):
            self.p["pose"] = f"{int(self.p['pose']):0{len(names[0])}d}"
        self.p["pose"] = self.p["pose"] or str(measurement.rng(142).choice(names))
        if self.p["pose"] not in names:
            raise ValueError(f"packet_misalignment: no pose '{self.p['pose']}' in the session")

    def payload(self, measurement, index, station, payload, rng):
        if station.name != self.p["pose"]:
            return payload
        packets = len(payload) // PACKET_BYTES
        start = int(rng.integers(1, max(2, packets // 2))) * PACKET_BYTES
        frame = 4 * measurement.radar.loops * measurement.radar.channels * measurement.radar.samples
        slipped = payload[:start] + payload[start + PACKET_BYTES:]
        return slipped + payload[-frame:][:PACKET_BYTES]
