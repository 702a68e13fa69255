"""The paper's radar and its beat signals.

Convention: x_k[n] = a exp(+j 2 pi (f_c tau + mu tau t_n - mu tau^2 / 2)), t_n = adc_start + n / f_s, virtual element
k = receivers * slot + rx.
"""
import dataclasses

import numpy as np

SPEED_OF_LIGHT = 299792458.0


@dataclasses.dataclass
class Radar:
    """What radar.yaml says. tx [T, 3] and rx [R, 3] in radar_link, m."""
    carrier_hz: float = 77.0e9
    slope_hz_per_s: float = 75.0e12
    samples: int = 64
    sample_rate_hz: float = 5.0e6
    adc_start_s: float = 6.0e-6
    loops: int = 1
    frame_period_s: float = 0.05
    tx: np.ndarray = dataclasses.field(default_factory=lambda: np.array([[0, 0, 0], [0, 0.0077867, 0]], float))
    rx: np.ndarray = dataclasses.field(
        default_factory=lambda: np.array([[0, 0, 0], [0, 0.0019467, 0], [0, 0.0038934, 0], [0, 0.0058401, 0]], float))

    @property
    def channels(self):
        """M."""
        return len(self.tx) * len(self.rx)

    @property
    def center_s(self):
        """t_c, centre of the ADC window."""
        return self.adc_start_s + self.samples / (2 * self.sample_rate_hz)

    @property
    def wavelength_m(self):
        """lambda_c, at the centre of the ADC window."""
        return SPEED_OF_LIGHT / self.center_hz

    @property
    def center_hz(self):
        """Frequency at the centre of the ADC window."""
        return self.carrier_hz + self.slope_hz_per_s * self.center_s

    @property
    def range_bin_m(self):
        """c / (2B)."""
        return SPEED_OF_LIGHT / (2 * self.slope_hz_per_s * self.samples / self.sample_rate_hz)

    @property
    def max_range_m(self):
        """N c / (2B)."""
        return self.samples * self.range_bin_m

    def contributions(self, lengths_m, coefficients):
        """c[P, M] at the window's centre of paths with lengths [P, M] and coefficients [P] (not conjugated here)."""
        tau = np.asarray(lengths_m) / SPEED_OF_LIGHT
        cycles = self.carrier_hz * tau + self.slope_hz_per_s * tau * self.center_s - 0.5 * self.slope_hz_per_s * tau**2
        return np.asarray(coefficients)[:, None] * np.exp(2j * np.pi * (cycles % 1.0))

    def grid(self, lengths_m, coefficients):
        """x[M, N], the sum of all paths: lengths [P, M], coefficients [P] or [P, M]."""
        lengths_m, coefficients = np.asarray(lengths_m, float), np.asarray(coefficients, complex)
        x = np.zeros((self.channels, self.samples), complex)
        if not len(lengths_m):
            return x
        if coefficients.ndim == 1:
            c = self.contributions(lengths_m, coefficients)
        else:
            c = self.contributions(lengths_m, np.ones(len(lengths_m))) * coefficients
        turn = 2j * np.pi * self.slope_hz_per_s / SPEED_OF_LIGHT / self.sample_rate_hz * lengths_m
        fine = 8
        for k in range(self.channels):
            step = np.exp(turn[:, k])
            powers = np.cumprod(np.repeat(step[:, None], fine, axis=1), axis=1)
            low = np.concatenate([np.ones((len(step), 1)), powers[:, :-1]], axis=1)
            blocks = -(-self.samples // fine)
            high = np.empty((len(step), blocks), complex)
            high[:, 0] = c[:, k] * np.exp(-turn[:, k] * (self.samples / 2))
            for j in range(1, blocks):
                high[:, j] = high[:, j - 1] * powers[:, -1]
            x[k] = (high.T @ low).reshape(-1)[:self.samples]
        return x

    def yaml(self):
        """Text of radar.yaml."""
        vector = lambda p: "[" + ", ".join(f"{v:g}" if v == 0 else repr(float(v)) for v in p) + "]"
        rows = lambda a: "[" + ", ".join(vector(p) for p in a) + "]"
        plain = lambda v: f"{v:.12g}" if "." in f"{v:.12g}" else f"{v:.1f}"
        number = lambda v, unit, suffix: plain(v / unit) + suffix
        return "\n".join([
            "device: awr2243",
            f"carrier_hz: {number(self.carrier_hz, 1e9, 'e+9')}",
            f"slope_hz_per_s: {number(self.slope_hz_per_s, 1e12, 'e+12')}",
            f"samples_per_chirp: {self.samples}",
            f"sample_rate_hz: {number(self.sample_rate_hz, 1e6, 'e+6')}",
            f"adc_start_s: {number(self.adc_start_s, 1e-6, 'e-6')}",
            f"loops_per_frame: {self.loops}",
            f"frame_period_s: {self.frame_period_s:g}",
            f"tx_position_m: {rows(self.tx)}",
            f"rx_position_m: {rows(self.rx)}",
            "layout: 4lane", ""])
