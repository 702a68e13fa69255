"""Effects of the receiver and its timing."""
import dataclasses
import math

import numpy as np
from scipy.signal import butter, freqs

from mmradartwin_tests.effects.effect import BASE, Effect, effect


class BeatLaw(Effect):
    """A complex gain that depends on an echo's beat frequency alone."""

    def echoes(self, measurement, station, echoes):
        response = lambda lengths: self.if_response(measurement, measurement.beat_hz(lengths[:, 0]))
        echoes.coefficients = echoes.coefficients * response(echoes.lengths_m)
        echoes.scatter_coefficients = echoes.scatter_coefficients * response(echoes.scatter.lengths_m)


@effect
class TxRxLeakage(Effect):
    """Body-fixed coupling: one arbitrary complex vector over the channels at one short range, after the IF filter."""
    name, main, rank = "tx_rx_leakage", "level_db", 2
    defaults = {"range_m": 0.06, "level_db": 3.0}

    def prepare(self, measurement):
        rng = measurement.rng(100)
        vector = rng.standard_normal(measurement.radar.channels) + 1j * rng.standard_normal(measurement.radar.channels)
        self.vector = vector / math.sqrt(np.mean(np.abs(vector)**2))

    def receive(self, measurement, index, station, x):
        radar = measurement.radar
        level = measurement.strongest * 10**(self.p["level_db"] / 20)
        t = (np.arange(radar.samples) - radar.samples / 2) / radar.sample_rate_hz
        return x + level * np.outer(self.vector, np.exp(2j * np.pi * measurement.beat_hz(2 * self.p["range_m"]) * t))


@effect
class RangeBias(Effect):
    """A constant added to every one-way range."""
    name, main = "range_bias", "range_m"
    defaults = {"range_m": 0.03}

    def echoes(self, measurement, station, echoes):
        shift = 2 * self.p["range_m"]
        echoes.lengths_m = echoes.lengths_m + shift
        echoes.scatter.lengths_m = echoes.scatter.lengths_m + shift


@effect
class RangeScale(Effect):
    """The chirp's slope is 1 + scale times what radar.yaml says."""
    name, main = "range_scale", "scale"
    defaults = {"scale": 0.005}
    plain = {"scale": 0.03}

    def radar(self, radar):
        return dataclasses.replace(radar, slope_hz_per_s=radar.slope_hz_per_s * (1 + self.p["scale"]))


@effect
class CarrierScale(Effect):
    """Element pitch against wavelength off by 1 + scale: the array is wider than described."""
    name, main = "carrier_scale", "scale"
    defaults = {"scale": 0.012}

    def radar(self, radar):
        stretch = np.array([1.0, 1 + self.p["scale"], 1.0])
        return dataclasses.replace(radar, tx=radar.tx * stretch, rx=radar.rx * stretch)


@effect
class IfHighpass(BeatLaw):
    """Two first-order sections, the second an octave above the first; corner_hz is -3 dB of the whole."""
    name, main = "if_highpass", "corner_hz"
    defaults = {"corner_hz": 800e3}

    def if_response(self, measurement, beat_hz):
        # (1 + y)(1 + 4 y) = 2 with y = (f1/corner)^2
        first = self.p["corner_hz"] * math.sqrt((math.sqrt(41.0) - 5) / 8)
        beat_hz = np.maximum(np.asarray(beat_hz, float), 1.0)
        return 1 / ((1 - 1j * first / beat_hz) * (1 - 2j * first / beat_hz))


@effect
class IfLowpass(BeatLaw):
    """Sixth-order Butterworth edge in the last bins."""
    name, main = "if_lowpass", "corner_hz"
    defaults = {"corner_hz": 3.6e6}
    plain = {"corner_hz": 1.8e6}

    def if_response(self, measurement, beat_hz):
        b, a = butter(6, 2 * math.pi * self.p["corner_hz"], analog=True)
        return freqs(b, a, 2 * math.pi * np.atleast_1d(np.asarray(beat_hz, float)))[1]


@effect
class ExcessAttenuation(Effect):
    """dB of power lost per metre of one-way range."""
    name, main = "excess_attenuation", "db_per_m"
    defaults = {"db_per_m": 0.8}
    plain = {"db_per_m": 2.0}

    def echoes(self, measurement, station, echoes):
        gain = lambda lengths: 10**(-self.p["db_per_m"] * lengths[:, 0] / 2 / 20)
        echoes.coefficients = echoes.coefficients * gain(echoes.lengths_m)
        echoes.scatter_coefficients = echoes.scatter_coefficients * gain(echoes.scatter.lengths_m)


@effect
class GainDrift(Effect):
    """Gain that changes with time: a rate, or steps_db at steps_s after the first pose, else at equal parts."""
    name, main, rank = "gain_drift", "db_per_hour", 2
    defaults = {"db_per_hour": 4.0, "steps_db": None, "steps_s": None}
    plain = {"db_per_hour": 120.0}

    def gain_db(self, measurement, index):
        """At one pose, 0 at the first."""
        stations = measurement.stations
        after_s = (stations[index].stamp_ns - stations[0].stamp_ns) / 1e9
        if self.p["steps_db"] is None:
            return self.p["db_per_hour"] * after_s / 3600
        steps = np.atleast_1d(self.p["steps_db"])
        if self.p["steps_s"] is not None:
            return float(steps[np.atleast_1d(self.p["steps_s"]) < after_s].sum())
        return float(steps[:index * (len(steps) + 1) // len(stations)].sum())

    def receive(self, measurement, index, station, x):
        return x * 10**(self.gain_db(measurement, index) / 20)

    def truth(self, measurement):
        if self.p["steps_db"] is None:
            return {"db_per_hour": self.p["db_per_hour"]}
        return {key: self.p[key] for key in ("steps_db", "steps_s") if self.p[key] is not None}


@effect
class IqImbalance(Effect):
    """An image at (R_max - R, -theta): x + beta conj(x); beta is one number or, of lists, one per receiver."""
    name, main, rank = "iq_imbalance", "image_db", 2
    defaults = {"image_db": -26.0, "phase_deg": None}

    def prepare(self, measurement):
        if self.p["phase_deg"] is None:
            drawn = 360 * measurement.rng(101).random(np.shape(self.p["image_db"]) or None)
            drawn = (drawn + 180) % 360 - 180   # as findings state it
            self.p["phase_deg"] = drawn.tolist() if isinstance(self.p["image_db"], list) else float(drawn)

    def receive(self, measurement, index, station, x):
        level = 10**(np.array(self.p["image_db"], float) / 20)
        beta = np.broadcast_to(level * np.exp(1j * np.radians(self.p["phase_deg"])), (len(measurement.radar.rx),))
        return x + np.tile(beta, len(measurement.radar.tx))[:, None] * np.conj(x)


@effect
class DcOffset(Effect):
    """A constant per channel."""
    name, main, rank = "dc_offset", "level_db", 2
    defaults = {"level_db": -6.0}

    def prepare(self, measurement):
        rng = measurement.rng(102)
        vector = rng.standard_normal(measurement.radar.channels) + 1j * rng.standard_normal(measurement.radar.channels)
        self.vector = vector / math.sqrt(np.mean(np.abs(vector)**2))

    def receive(self, measurement, index, station, x):
        return x + measurement.strongest * 10**(self.p["level_db"] / 20) * self.vector[:, None]


@effect
class SecondHarmonic(Effect):
    """Square law ahead of the ADC's filter: echoes at sums of beat frequencies, none beyond the sampling rate.

    level_db: against the host, at the session's strongest host.
    """
    name, main, rank = "second_harmonic", "level_db", 2
    defaults = {"level_db": -22.0}
    STRONGEST = 60

    def auxiliary(self, measurement, station, echoes):
        """Grid [M, N] of all products of the strongest echoes."""
        radar = measurement.radar
        order = np.argsort(-np.abs(echoes.coefficients))[:self.STRONGEST]
        c = radar.contributions(echoes.lengths_m[order], echoes.coefficients[order])
        beat = measurement.beat_hz(echoes.lengths_m[order])
        t = (np.arange(radar.samples) - radar.samples / 2) / radar.sample_rate_hz
        x = np.zeros((radar.channels, radar.samples), complex)
        for i in range(len(order)):
            total = beat[i] + beat
            keep = total[:, 0] < 0.95 * radar.sample_rate_hz
            x += np.sum((c[i] * c[keep])[:, :, None] * np.exp(2j * np.pi * total[keep][:, :, None] * t), axis=0)
        return x

    def receive(self, measurement, index, station, x):
        return x + 10**(self.p["level_db"] / 20) / measurement.strongest * measurement.auxiliary[self.name][index]


@effect
class AdcSaturation(Effect):
    """So much gain that this share of all I and Q samples would lie beyond full scale."""
    name, main, rank = "adc_saturation", "clipped_fraction", 2
    defaults = {"clipped_fraction": 0.004}

    def after_gain(self, measurement, grids):
        size = np.concatenate([np.abs(np.concatenate([g.real.ravel(), g.imag.ravel()])) for g in grids])
        measurement.gain = 1 / np.quantile(size, 1 - self.p["clipped_fraction"])


@effect
class NoiseFloor(Effect):
    """Thermal noise above the level that the session's twin states (rms of a complex sample, dBFS)."""
    name, main, rank = "noise_floor", "delta_db", 2
    defaults = {"delta_db": 6.0}

    def after_gain(self, measurement, grids):
        self.stated_dbfs = 20 * math.log10(measurement.noise_rms * measurement.gain)
        measurement.noise_rms *= 10**(self.p["delta_db"] / 20)

    def described_mechanisms(self, measurement, mechanisms):
        return {**(mechanisms or BASE), "noise_floor": {"level_dbfs": self.stated_dbfs}}
