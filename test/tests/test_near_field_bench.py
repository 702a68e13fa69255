"""The generator of near-field benches, against closed forms."""
import dataclasses
import unittest

import numpy as np
from scipy.special import fresnel

from diagnose_program import PROGRAM, diagnose
from in_folder import InFolder
from mmradartwin_tests.geometry import sheet
from mmradartwin_tests.near_field_bench import BUILT, Bench, Faults, PanelOptics, Station
from mmradartwin_tests.radar import SPEED_OF_LIGHT

SAMPLES = 128   # a quarter of the real bench's, and of its ranges; the same range bin


class Echoes(unittest.TestCase):
    """The generator against closed forms."""

    def test_a_small_plate_echoes_by_fresnels_integrals(self):
        side_m, distance_m = 0.05, 0.6
        plate = sheet((distance_m, -side_m / 2, -side_m / 2), (0, side_m, 0), (0, 0, side_m)).rectangles()[0]
        frequency = np.array([77.5e9, 79.0e9])
        told = PanelOptics(plate, 0.0008).field(np.zeros(3), np.zeros(3), frequency)
        wave = SPEED_OF_LIGHT / frequency
        s, c = fresnel(side_m / np.sqrt(wave * distance_m))
        wanted = 2 * (c**2 + s**2) / (2 * distance_m)   # |2 (C + jS) / (1 + j)|^2 of the plate's image
        np.testing.assert_allclose(np.abs(told), wanted, rtol=5e-3)

    def test_echoes_stand_where_the_way_and_the_bias_put_them(self):
        bench = Bench(dataclasses.replace(BUILT, leakage_db=None, image_db=None),
                      places=[Station(0.349, 0.0, "here")], samples=SAMPLES)
        radar, station = bench.radar, bench.reported[0]
        echoes = bench.echoes(station)
        delay = np.exp(4j * np.pi * radar.slope_hz_per_s * BUILT.range_bias_m / SPEED_OF_LIGHT
                       * np.arange(radar.samples) / radar.sample_rate_hz)
        for name, range_m in (("plate", 0.412), ("bounce1", 0.761), ("bounce2", 1.109)):
            power = np.abs(np.fft.fft(echoes[name][0] * delay * np.hanning(radar.samples), 64 * radar.samples))
            self.assertAlmostEqual(power.argmax() / 64 * radar.range_bin_m, range_m, delta=0.004, msg=name)

    def test_receivers_differ_as_it_says(self):
        told = Bench(Faults(phase_deg=BUILT.phase_deg), places=[Station(0.349, 0.0, "here")], samples=64)
        clean = Bench(Faults(), places=[Station(0.349, 0.0, "here")], samples=64)
        turned = told.grid(told.reported[0]) / clean.grid(clean.reported[0])
        np.testing.assert_allclose(np.degrees(np.angle(turned[:, 5])), BUILT.phase_deg, atol=1e-6)


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class Diagnosis(InFolder):
    """What the diagnosis says of the bench with all its faults."""

    def test_all_faults_are_found(self):
        Bench(BUILT, samples=SAMPLES).write(self.at("bench"))
        status, findings, errors = diagnose(self.at("bench"), self.at("out"))
        self.assertEqual(status, 0, msg=errors)
        found = {one["cause"]: one["parameters"] for one in findings["findings"]}
        # Edges of the plate, which the twin has not, are named diffuse scattering of metal.
        self.assertEqual(set(found) - {"diffuse_scattering"},
                         {"tx_rx_leakage", "iq_imbalance", "range_bias", "second_harmonic", "channel_phase_error"})
        low, high = found["range_bias"]["range_m"]["ci95"]
        self.assertTrue(low < BUILT.range_bias_m < high, msg=f"{low} to {high} m")
        self.assertLess(high - low, 0.03)
        bounces = next(one for one in findings["findings"] if one["cause"] == "second_harmonic")
        self.assertEqual(bounces["mechanism"]["second_harmonic"]["kind"], "bounce")
        self.assertAlmostEqual(found["tx_rx_leakage"]["range_m"]["value"], BUILT.leakage_range_m, delta=0.001)
        self.assertAlmostEqual(found["tx_rx_leakage"]["level_db"]["value"], BUILT.leakage_db, delta=0.5)
        np.testing.assert_allclose(found["iq_imbalance"]["image_db"]["value"], BUILT.image_db, atol=0.3)
        np.testing.assert_allclose(found["channel_phase_error"]["phase_deg"]["value"], BUILT.phase_deg, atol=1.5)


if __name__ == "__main__":
    unittest.main()
