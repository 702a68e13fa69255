"""The blind protocol's effects that are put into a real recording."""
import math
import os
import unittest

import numpy as np

from mmradartwin_tests.blind import draws, recordings
from in_folder import InFolder
from test_blind_scores import finding, number


@unittest.skipIf(recordings.capture_file() is None,
                 "openradar_indoor is not here; set MMRADARTWIN_DATA to the folder with the real recordings")
class RealRecording(InFolder):
    @classmethod
    def setUpClass(cls):
        cls.x = recordings.read_capture()

    def injected(self, name, seed=11):
        data, parameters = recordings.inject(name, np.random.default_rng(seed))
        raw = np.frombuffer(data, "<i2").reshape(128, 2, 128, 2, 4)
        return raw[:, :, :, 0] + 1j * raw[:, :, :, 1], parameters

    def test_the_copy_is_the_recording(self):
        recordings.write_untouched(self.at("s"))
        with open(self.at("s", "captures", "001.bin"), "rb") as copy, open(recordings.capture_file(), "rb") as source:
            content = source.read()
            self.assertEqual(copy.read(), content)
        self.assertEqual(recordings.payload(self.x), content)

    def test_every_session_has_the_same_files_whatever_is_hidden(self):
        names = set()
        for i in range(len(recordings.INJECTIONS)):
            (truth,) = recordings.write_session(draws.Trial("recording", "office", 1, i), self.at(str(i)))
            names.add(truth["cause"])
            self.assertEqual(sorted(os.listdir(self.at(str(i)))), ["captures", "poses.csv", "radar.yaml",
                                                                   "session.yaml"])
            self.assertEqual(os.path.getsize(self.at(str(i), "captures", "001.bin")), 524288)
        self.assertEqual(len(names), len(recordings.INJECTIONS))

    def test_channel_errors_are_those_of_the_truth(self):
        y, truth = self.injected("channel_phase_error")
        for k in range(8):
            a, b = self.x[:, k // 4, :, k % 4].ravel(), y[:, k // 4, :, k % 4].ravel()
            ratio = np.vdot(a, b) / np.vdot(a, a)
            self.assertAlmostEqual(20 * math.log10(abs(ratio)), truth["gain_db"][k], delta=0.01)
            self.assertAlmostEqual((math.degrees(np.angle(ratio)) - truth["phase_deg"][k] + 180) % 360 - 180, 0,
                                   delta=0.1)

    def test_conventions(self):
        np.testing.assert_array_equal(self.injected("iq_conjugation")[0], np.conj(self.x))
        y, _ = self.injected("channel_conjugation")
        for k in range(8):
            np.testing.assert_array_equal(y[:, k // 4, :, k % 4], self.x[:, (7 - k) // 4, :, (7 - k) % 4])

    def test_leakage_is_one_tone_in_every_chirp(self):
        y, truth = self.injected("tx_rx_leakage")
        added = (y - self.x).mean(axis=0)
        t = np.arange(128) / 2.5e6
        tone = np.exp(-2j * np.pi * 60e12 * 2 * truth["range_m"] / 299792458.0 * t)
        vector = (added * tone[:, None]).mean(axis=1)
        np.testing.assert_allclose(added, vector[:, None, :] * tone.conj()[:, None], atol=1.0)    # counts
        level = math.sqrt(np.mean(np.abs(vector)**2)) / recordings.strongest(self.x)
        self.assertAlmostEqual(20 * math.log10(level), truth["level_db"], delta=0.05)

    def test_saturated_share(self):
        y, truth = self.injected("adc_saturation")
        parts = np.concatenate([y.real.ravel(), y.imag.ravel()])
        self.assertAlmostEqual(np.mean(np.abs(parts) >= 32767), truth["clipped_fraction"], delta=2e-4)

    def test_lost_packets(self):
        data, truth = recordings.inject("packet_loss", np.random.default_rng(11))
        with open(recordings.capture_file(), "rb") as source:
            content = source.read()
        lost = [i for i in range(0, len(content), 1456) if not any(data[i:i + 1456])]
        self.assertAlmostEqual(len(lost) / 361, truth["lost_fraction"], places=9)
        for i in range(0, len(content), 1456):
            self.assertTrue(i in lost or data[i:i + 1456] == content[i:i + 1456])

    def test_the_walker_is_where_and_as_fast_as_the_truth_says(self):
        for seed in (11, 12, 13):
            y, truth = self.injected("moving_target", seed)
            added = (y - self.x) * np.hanning(128)[None, None, :, None] * np.hanning(128)[:, None, None, None]
            size = 8 * 128
            spectrum = np.fft.fft2(added[:, 0, :, 0], (size, size))
            doppler, beat = np.unravel_index(np.abs(spectrum).argmax(), spectrum.shape)
            wavelength = 299792458.0 / (77.4201e9 + 60e12 * (7e-6 + 64 / 2.5e6))
            speed = ((doppler + size / 2) % size - size / 2) / size / (2 * 92e-6) * wavelength / 2
            range_m = beat / size * 2.5e6 / 60e12 * 299792458.0 / 2
            self.assertAlmostEqual(abs(speed), truth["speed_m_per_s"], delta=0.03, msg=f"seed {seed}")
            self.assertAlmostEqual(range_m, math.hypot(truth["x_m"], truth["y_m"]), delta=0.04, msg=f"seed {seed}")
            steps = np.angle(spectrum[doppler, beat].conj() *
                             np.fft.fft2(added[:, 0, :, 1], (size, size))[doppler, beat])
            sine = -steps / (2 * np.pi) * wavelength / 0.0019361
            self.assertAlmostEqual(math.asin(sine), math.atan2(truth["y_m"], truth["x_m"]), delta=0.05,
                                   msg=f"seed {seed}")

    def test_what_the_recording_gives_anyway_is_taken_out(self):
        place = lambda r, a: {**finding("moving_target"), "where": [{"range_m": [r - 0.1, r + 0.1],
                                                                    "azimuth_deg": [a - 5, a + 5]}]}
        untouched = [place(2.95, -7), place(2.97, 13)]
        third = place(1.5, 20)
        self.assertEqual(recordings.beyond([place(2.9, 12), third, place(2.95, -6)], untouched), [third])
        self.assertEqual(recordings.beyond([finding("packet_loss")], untouched), [finding("packet_loss")])
        self.assertEqual(recordings.beyond([], untouched), [])
        leaks = lambda level, half: finding("tx_rx_leakage", level_db=number(level, level - half, level + half))
        self.assertEqual(recordings.beyond([leaks(0.3, 0.2)], [leaks(0.0, 1.0)]), [])
        (sum_of_both,) = recordings.beyond([leaks(5.0, 0.5)], [leaks(0.0, 1.0)])
        self.assertEqual(sum_of_both["parameters"], {"level_db": number(5.0)})


if __name__ == "__main__":
    unittest.main()
