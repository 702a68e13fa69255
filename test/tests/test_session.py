"""Files of a session: what they hold, how bytes lie, and that nothing hidden shows."""
import csv
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np

from mmradartwin_tests.radar import Radar
from mmradartwin_tests.session import NOISE_RMS, Measurement, Settings

SCRIPT = os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "scripts", "make_session.py")


def generate(directory, **options):
    settings = Settings(output=os.path.join(directory, "session"), truth=os.path.join(directory, "truth.json"),
                        **{"seed": 3, "poses": 3, "frames": 4, **options})
    measurement = Measurement(settings)
    return measurement, measurement.run()


def poses_of(directory):
    with open(os.path.join(directory, "session", "poses.csv"), encoding="ascii") as file:
        return list(csv.DictReader(file))


class Files(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = tempfile.TemporaryDirectory()
        cls.measurement, cls.results = generate(cls.directory.name)

    @classmethod
    def tearDownClass(cls):
        cls.directory.cleanup()

    def test_directory_is_complete(self):
        names = sorted(os.listdir(os.path.join(self.directory.name, "session")))
        self.assertEqual(names, ["captures", "materials.yaml", "office.obj", "poses.csv", "radar.yaml", "scene.yaml",
                                 "session.yaml"])
        for row in poses_of(self.directory.name):
            size = os.path.getsize(os.path.join(self.directory.name, "session", "captures", row["pose"] + ".bin"))
            self.assertEqual(size, 4 * 2048)

    def test_byte_layout(self):
        # Sample n, receiver r of transmitter t: I at 16 (64 t + n) + 2 r, Q eight bytes on.
        with open(os.path.join(self.directory.name, "session", "captures", "001.bin"), "rb") as file:
            payload = file.read()
        x = self.results[0][0] * self.measurement.gain * 32768
        noise = self.measurement.noise_rms * self.measurement.gain * 32768
        worst = 0.0
        for frame in range(4):
            for t in range(2):
                for n in range(0, 64, 7):
                    for r in range(4):
                        at = 2048 * frame + 16 * (64 * t + n) + 2 * r
                        i = int.from_bytes(payload[at:at + 2], "little", signed=True)
                        q = int.from_bytes(payload[at + 8:at + 10], "little", signed=True)
                        worst = max(worst, abs(complex(i, q) - x[4 * t + r, n]))
        self.assertLess(worst, 6 * noise)
        self.assertGreater(np.abs(x).max(), 40 * noise)

    def test_noise_level_and_frames(self):
        cube = np.fromfile(os.path.join(self.directory.name, "session", "captures", "002.bin"), "<i2").reshape(4, 2,
            64, 2, 4)
        values = cube[:, :, :, 0, :] + 1j * cube[:, :, :, 1, :]
        spread = values - values.mean(axis=0)
        rms = math.sqrt((np.abs(spread)**2).sum() / (3 * 512)) / (self.measurement.gain * 32768)
        self.assertAlmostEqual(rms / self.measurement.noise_rms, 1.0, delta=0.05)

    def test_the_strongest_sample_is_some_10_db_below_full_scale(self):
        peak = max(np.abs(np.fromfile(os.path.join(self.directory.name, "session", "captures", row["pose"] + ".bin"),
                                      "<i2").astype(int)).max()
                   for row in poses_of(self.directory.name))
        self.assertLess(20 * math.log10(peak / 32768), -8.5)
        self.assertGreater(20 * math.log10(peak / 32768), -12.0)

    def test_nothing_tells_the_truth(self):
        with open(os.path.join(self.directory.name, "truth.json"), encoding="ascii") as file:
            self.assertEqual(json.load(file)["effects"], [])
        for name in ("session.yaml", "radar.yaml", "scene.yaml", "materials.yaml", "poses.csv", "office.obj"):
            with open(os.path.join(self.directory.name, "session", name), encoding="ascii") as file:
                text = file.read().lower()
            for word in ("seed", "truth", "effect", "gain_db", "tier"):
                self.assertNotIn(word, text, msg=name)

    def test_speckle_seed_changes_rough_surfaces_alone(self):
        with tempfile.TemporaryDirectory() as other:
            measurement, results = generate(other, speckle_seed=99)
            self.assertEqual(self.results[1], results[1])      # the same specular paths
            self.assertGreater(np.abs(self.results[0][0] - results[0][0]).max(), 0)
            self.assertEqual([s.name for s in measurement.stations], [s.name for s in self.measurement.stations])


class Campaign(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.measurement = Measurement(Settings(output="", seed=11))
        cls.stations = cls.measurement.stations

    def test_the_whole_campaign_has_156_poses_at_22_places(self):
        self.assertEqual(len(self.stations), 156)
        self.assertEqual(len({s.location for s in self.stations}), 22)
        self.assertEqual(len({s.name for s in self.stations}), 156)

    def test_two_duplicates_and_no_more(self):
        def is_duplicate(a, b):
            d = a.reported.position - b.reported.position
            turn = a.reported.rotation.T @ b.reported.rotation
            heading = abs(math.degrees(math.atan2(turn[1, 0], turn[0, 0])))
            return np.hypot(d[0], d[1]) < 0.1 and abs(d[2]) < 0.02 and heading < 1.0
        pairs = [(a.name, b.name) for i, a in enumerate(self.stations) for b in self.stations[i + 1:]
                 if is_duplicate(a, b)]
        self.assertEqual(sorted(b for _, b in pairs), ["155", "156"])

    def test_times_do_not_overlap(self):
        for a, b in zip(self.stations, self.stations[1:]):
            self.assertGreater(b.stamp_ns, a.stamp_ns + 100 * 50_000_000)

    def test_places_are_free(self):
        for s in self.stations[:154:7]:
            self.assertIsNone(self.measurement.room.inside(s.true.position))
            self.assertGreaterEqual(self.measurement.room.clearance(s.true.position), 0.4)
            self.assertTrue(0.8 <= s.true.position[2] <= 1.4)

    def test_pose_errors(self):
        offset = np.array([s.reported.position - s.true.position for s in self.stations[:154]])
        turns = [s.true.rotation.T @ s.reported.rotation for s in self.stations[:154]]
        yaw = np.degrees([math.atan2(t[1, 0], t[0, 0]) for t in turns])
        self.assertAlmostEqual(offset.std(), 0.003, delta=0.0005)
        self.assertAlmostEqual(yaw.std(), 0.3, delta=0.07)


class Noise(unittest.TestCase):
    def test_wall_at_three_metres_stands_fifty_decibels_over_noise(self):
        # One chirp, one channel, one Hann-windowed range bin: gain N / 1.5.
        radar = Radar()
        amplitude = radar.wavelength_m / (4 * math.pi * 6.0) * 0.3926
        level = 20 * math.log10(amplitude / NOISE_RMS) + 10 * math.log10(radar.samples / 1.5)
        self.assertAlmostEqual(level, 50.0, delta=0.5)


class CommandLine(unittest.TestCase):
    def run_script(self, *arguments):
        return subprocess.run([sys.executable, SCRIPT, *arguments], capture_output=True, text=True, check=False)

    def test_errors_are_one_line(self):
        with tempfile.TemporaryDirectory() as directory:
            target = os.path.join(directory, "s")
            for arguments in (["--effect", "no_such"], ["--param", "a=1"], ["--poses", "0"],
                              ["--truth", target + "/t.json"],
                              ["--effect", "range_bias", "--param", "nonsense=1"]):
                result = self.run_script("--output", target, "--seed", "1", *arguments)
                self.assertEqual(result.returncode, 2, msg=arguments)
                self.assertTrue(result.stderr.startswith("error: "), msg=result.stderr)
                self.assertEqual(result.stderr.count("\n"), 1, msg=result.stderr)
                self.assertFalse(os.path.exists(target))

    def test_same_seed_same_bytes(self):
        with tempfile.TemporaryDirectory() as directory:
            contents = []
            for run in ("a", "b"):
                target = os.path.join(directory, run)
                result = self.run_script("--output", target, "--seed", "4", "--poses", "2", "--frames", "2", "--jobs",
                                         "2" if run == "a" else "1")
                self.assertEqual(result.returncode, 0, msg=result.stderr)
                with open(os.path.join(target, "captures", "002.bin"), "rb") as file:
                    contents.append(file.read())
            self.assertEqual(contents[0], contents[1])


if __name__ == "__main__":
    unittest.main()
