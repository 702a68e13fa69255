"""Beat signals, signs and bins."""
import math
import unittest

import numpy as np

from mmradartwin_tests.radar import SPEED_OF_LIGHT, Radar


class BeatSignal(unittest.TestCase):
    def test_figures_of_the_paper(self):
        radar = Radar()
        self.assertAlmostEqual(radar.range_bin_m, 0.1561, places=4)
        self.assertAlmostEqual(radar.center_hz, 77.93e9, delta=1)
        self.assertEqual(radar.channels, 8)

    def test_grid_is_the_formula(self):
        radar = Radar()
        rng = np.random.default_rng(1)
        lengths = rng.uniform(1, 19, (5, 8))
        alpha = rng.standard_normal(5) + 1j * rng.standard_normal(5)
        tau = (lengths / SPEED_OF_LIGHT)[:, :, None]
        t = radar.adc_start_s + np.arange(64) / radar.sample_rate_hz
        direct = (alpha[:, None, None] * np.exp(2j * np.pi * (
            radar.carrier_hz * tau + radar.slope_hz_per_s * tau * t - 0.5 * radar.slope_hz_per_s * tau**2))).sum(axis=0)
        np.testing.assert_allclose(radar.grid(lengths, alpha), direct, atol=1e-7)

    def test_a_target_to_the_left(self):
        radar = Radar()
        theta, distance = math.radians(25.0), 30.0
        point = distance * np.array([math.cos(theta), math.sin(theta), 0])
        lengths = (np.linalg.norm(point - radar.tx, axis=1)[:, None]
                   + np.linalg.norm(point - radar.rx, axis=1)).reshape(1, -1)
        c = radar.contributions(lengths, np.ones(1))[0]
        k = np.arange(8)
        pitch = radar.rx[1, 1]
        expected = np.exp(-2j * np.pi * pitch * k * math.sin(theta) / radar.wavelength_m)
        np.testing.assert_allclose(c / c[0], expected, atol=0.015)

    def test_peak_in_bin_and_side(self):
        radar = Radar()
        theta, bin_index = math.radians(40.0), 20
        point = bin_index * radar.range_bin_m * np.array([math.cos(theta), math.sin(theta), 0])
        lengths = (np.linalg.norm(point - radar.tx, axis=1)[:, None]
                   + np.linalg.norm(point - radar.rx, axis=1)).reshape(1, -1)
        x = radar.grid(lengths, np.ones(1))
        window = 0.5 * (1 - np.cos(2 * np.pi * np.arange(64) / 64))
        spectra = np.fft.fft(x * window, axis=1)
        s = np.sin(np.radians(np.linspace(-80, 80, 161)))
        steering = np.exp(2j * np.pi * radar.rx[1, 1] / radar.wavelength_m * np.outer(np.arange(8), s))
        level = np.abs(spectra.T @ steering)
        r, a = np.unravel_index(level.argmax(), level.shape)
        self.assertEqual(r, bin_index)
        self.assertAlmostEqual(a - 80, 40, delta=1)


if __name__ == "__main__":
    unittest.main()
