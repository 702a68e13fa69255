"""The radar's front: chirp, elements and their patterns, which ripple over azimuth and differ from element to element."""
import dataclasses
import math

import numpy as np

C = 299792458.0
PITCH_M = 0.0019467
EDGE_SINE = math.sin(math.radians(20.0))     # flat in elevation up to here
END_SINE = math.sin(math.radians(24.0))      # nothing from here on
FADE_DEG = 2.0                               # before the plane of the array, where elements fall off


@dataclasses.dataclass
class Front:
    """Chirp and elements. Element positions [n, 3] in radar axes."""
    carrier_hz: float = 77.0e9
    slope: float = 75.0e12
    samples: int = 64
    rate_hz: float = 5.0e6
    start_s: float = 6.0e-6
    tx_y_m: tuple = (0.0, 4 * PITCH_M - 1e-7)
    rx_y_m: tuple = (0.0, PITCH_M, 2 * PITCH_M, 3 * PITCH_M)
    ripple_db: float = 0.5           # of one way, common to all elements
    own_ripple_db: float = 0.2       # of one way, of each element
    own_ripple_deg: float = 1.5
    seed: int = 0
    cos_exponent: float = 0.0        # one-way power goes by cos^n of the azimuth
    pitch_scale: float = 0.0         # elements stand wider by this share

    def __post_init__(self):
        rng = np.random.default_rng([self.seed, 40])
        self.azimuth = np.radians(np.arange(-90, 91))
        common = self.ripple_db * self._ripple(rng)
        self.table = np.array([10**((common + self.own_ripple_db * self._ripple(rng)) / 20) *
                               np.exp(1j * np.radians(self.own_ripple_deg) * self._ripple(rng)) for _ in range(6)])
        edge = np.clip((np.radians(90) - np.abs(self.azimuth)) / np.radians(FADE_DEG), 0, 1)
        self.table *= np.sin(np.pi / 2 * edge)**2 * np.maximum(np.cos(self.azimuth), 0)**(self.cos_exponent / 2)

    def _ripple(self, rng):
        """Three waves over azimuth, 1 at most."""
        wave = sum(np.cos(2 * np.pi * self.azimuth / np.radians(rng.uniform(25, 90)) + rng.uniform(0, 2 * np.pi))
                   for _ in range(3))
        return wave / np.abs(wave).max()

    @property
    def tx(self):
        """[2, 3]"""
        return np.array([[0.0, y * (1 + self.pitch_scale), 0.0] for y in self.tx_y_m])

    @property
    def rx(self):
        """[4, 3]"""
        return np.array([[0.0, y * (1 + self.pitch_scale), 0.0] for y in self.rx_y_m])

    @property
    def center_s(self):
        """Middle of the samples."""
        return self.start_s + self.samples / (2 * self.rate_hz)

    @property
    def wavelength_m(self):
        """In the middle of the samples."""
        return C / (self.carrier_hz + self.slope * self.center_s)

    def gains(self, directions):
        """[6, P] complex one-way amplitudes of the two transmitters and four receivers; unit directions in radar axes."""
        azimuth = np.arctan2(directions[:, 1], directions[:, 0])
        place = np.clip(np.degrees(azimuth) + 90, 0, 179.999)
        i = place.astype(int)
        part = place - i
        found = self.table[:, i] * (1 - part) + self.table[:, i + 1] * part
        fall = np.clip((END_SINE - np.abs(directions[:, 2])) / (END_SINE - EDGE_SINE), 0, 1)
        return found * (np.sin(np.pi / 2 * fall)**2 * (directions[:, 0] > 0))

    def phase(self, lengths_m):
        """exp(j phase) of beat signals in the middle of the samples, by the length of the way."""
        delay = lengths_m / C
        cycles = (self.carrier_hz + self.slope * self.center_s) * delay - 0.5 * self.slope * delay**2
        return np.exp(2j * np.pi * (cycles % 1.0))

    def beat(self, lengths_m, slope_scale=0.0):
        """[L, N] beat signals of lengths, turned to 0 in the middle of the samples."""
        t = np.arange(self.samples) / self.rate_hz + self.start_s - self.center_s
        return np.exp(2j * np.pi * self.slope * (1 + slope_scale) / C * np.outer(lengths_m, t))
