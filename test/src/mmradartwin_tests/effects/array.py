"""Effects of the antenna array."""
import math

import numpy as np

from mmradartwin_tests.effects.effect import Effect, effect


@effect
class ChannelPhaseError(Effect):
    """A phase and gain per virtual channel; channel 0 is 0. Drawn at 10 degrees and 0.5 dB rms where not given."""
    name, rank = "channel_phase_error", 2
    defaults = {"phase_deg": None, "gain_db": None, "rms_deg": 10.0, "rms_db": 0.5}
    main = "rms_deg"

    def prepare(self, measurement):
        rng = measurement.rng(110)
        phase, gain = rng.standard_normal(8), rng.standard_normal(8)
        if self.p["phase_deg"] is None:
            self.p["phase_deg"] = list(self.p["rms_deg"] * (phase - phase[0]))
        if self.p["gain_db"] is None:
            self.p["gain_db"] = list(self.p["rms_db"] * (gain - gain[0]))

    def receive(self, measurement, index, station, x):
        phase, gain = np.array(self.p["phase_deg"], float), np.array(self.p["gain_db"], float)
        return x * (10**(gain / 20) * np.exp(1j * np.radians(phase)))[:, None]

    def truth(self, measurement):
        return {key: self.p[key] for key in ("phase_deg", "gain_db")}


@effect
class TxImbalance(Effect):
    """The second transmitter's block of channels turned and scaled."""
    name, main, rank = "tx_imbalance", "phase_deg", 2
    defaults = {"phase_deg": 25.0, "gain_db": -1.0}

    def receive(self, measurement, index, station, x):
        x = x.copy()
        x[len(measurement.radar.rx):] *= 10**(self.p["gain_db"] / 20) * np.exp(1j * math.radians(self.p["phase_deg"]))
        return x


@effect
class TxDelay(Effect):
    """A longer feed to one transmitter: all its echoes travel delay_m farther, one-way."""
    name, main = "tx_delay", "delay_m"
    defaults = {"slot": 1, "delay_m": 0.05}

    def echoes(self, measurement, station, echoes):
        receivers = len(measurement.radar.rx)
        late = np.zeros(measurement.radar.channels)
        late[self.p["slot"] * receivers:(self.p["slot"] + 1) * receivers] = 2 * self.p["delay_m"]
        echoes.lengths_m = echoes.lengths_m + late
        echoes.scatter.lengths_m = echoes.scatter.lengths_m + late


@effect
class IqConjugation(Effect):
    """Q inverted."""
    name, rank = "iq_conjugation", 2

    def receive(self, measurement, index, station, x):
        return np.conj(x)


@effect
class ChannelConjugation(Effect):
    """The array's direction reversed: the order 7..0."""
    name, rank = "channel_conjugation", 2

    def receive(self, measurement, index, station, x):
        return x[::-1]


@effect
class ChannelPermutation(Effect):
    """order[i] is the true channel delivered in place i."""
    name, rank = "channel_permutation", 2
    defaults = {"order": [1, 0, 2, 3, 5, 4, 6, 7]}

    def receive(self, measurement, index, station, x):
        return x[np.array(self.p["order"], int)]

    def truth(self, measurement):
        return {"order": [int(i) for i in self.p["order"]]}


class Pattern(Effect):
    """A one-way power pattern g = cos^n psi applied at departure and arrival."""
    main = "cos_exponent"

    def cosine(self, directions_radar):
        """cos psi of unit directions [P, 3] in radar_link."""
        return directions_radar[:, 0]

    def gain(self, measurement, station, directions):
        """One-way amplitude of directions [P, 3] in map."""
        cosine = np.clip(self.cosine(station.true.to_radar(np.atleast_2d(directions))), 0.0, 1.0)
        return cosine**(self.p["cos_exponent"] / 2)

    def echoes(self, measurement, station, echoes):
        if len(echoes.paths):
            legs = (self.gain(measurement, station, np.array([p.departure for p in echoes.paths])) *
                    self.gain(measurement, station, np.array([p.arrival for p in echoes.paths])))
            echoes.coefficients = echoes.coefficients * legs
        ray = echoes.scatter.points - station.true.position
        ray /= np.linalg.norm(ray, axis=1)[:, None]
        echoes.scatter_coefficients = echoes.scatter_coefficients * self.gain(measurement, station, ray)**2


@effect
class ElementPattern(Pattern):
    """Azimuth roll-off; psi is the azimuth."""
    name = "element_pattern"
    defaults = {"cos_exponent": 2.1}

    def cosine(self, directions_radar):
        return directions_radar[:, 0] / np.hypot(directions_radar[:, 0], directions_radar[:, 1])


@effect
class ElevationPattern(Pattern):
    """The same in elevation."""
    name = "elevation_pattern"
    defaults = {"cos_exponent": 12.0}
    plain = {"cos_exponent": 30.0}

    def cosine(self, directions_radar):
        return np.sqrt(1 - directions_radar[:, 2]**2)
