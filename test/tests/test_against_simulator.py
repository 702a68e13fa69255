"""The simulator's paths against the generator's: two codes that share nothing but the physical model."""
import collections
import csv
import math
import os
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np

from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.path_comparison import compare, match, read_paths
from mmradartwin_tests.session import Measurement, Settings
from mmradartwin_tests.tracing import path_arrays
from chosen_sessions import seeds

PROGRAM = find_program("mmradartwin_sim", "simulate")
SEED = 2
KINDS = {("specular", 1), ("specular", 2), ("specular", 3), ("corner", 2)}   # event and bounces, all of the office


def kind(row):
    """(event, bounces) of a path."""
    return row["event"], len(row["actors"].split(";"))


class Simulated:
    """12 poses with exact poses and 24 as measured."""
    seed = None

    @classmethod
    def setUpClass(cls):
        cls.directory = tempfile.TemporaryDirectory()
        print(f"MMRADARTWIN_SIMULATOR_SEED={cls.seed}", file=sys.stderr, flush=True)
        cls.measurements = {tier: cls.generate(tier) for tier in ("exact", "default")}

    @classmethod
    def tearDownClass(cls):
        cls.directory.cleanup()

    @classmethod
    def generate(cls, tier):
        at = lambda name: os.path.join(cls.directory.name, tier + name)
        measurement = Measurement(Settings(output=at("_session"), seed=cls.seed, poses=12 if tier == "exact" else 24,
                                           frames=1, tier=tier, paths_csv=at("_true")))
        measurement.run()
        run = subprocess.run([PROGRAM, at("_session"), "--output", at("_sim"), "--diffuse-records", "points",
                              "--noise", "none"],
                             capture_output=True, text=True, check=False)
        if run.returncode != 0:
            raise RuntimeError(f"simulate ended with {run.returncode}: {run.stderr}")
        return measurement

    def folders(self, tier):
        base = os.path.join(self.directory.name, tier)
        return base + "_true", os.path.join(base + "_sim", "paths")

    def test_isolated_strong_paths_of_a_measured_session(self):
        result = compare(*self.folders("default"))
        self.assertGreaterEqual(result["isolated"], 8, msg=f"seed {self.seed}")
        # Signed: the poses' own errors (3 mm, 0.3 deg each) are not the simulator's, and cancel over few poses alone.
        for key, limit in (("level_db", 0.3), ("range_m", 0.005), ("azimuth_deg", 0.3)):
            self.assertLessEqual(abs(result["bias"][key]), limit, msg=f"{key}, seed {self.seed}")

    def test_every_path_where_poses_are_exact(self):
        # One path in fifty of a kind may hang on a millimetre: a ray that grazes an edge, a factor next to the cutoff.
        # Of a kind with fewer that is none, and at places that nobody has seen one.
        result = compare(*self.folders("exact"))
        count = len(result["pairs"])
        self.assertGreater(count, 50)
        paired = collections.Counter(kind(pair[4]) for pair in result["pairs"])
        self.assertEqual(set(paired), KINDS, msg=f"seed {self.seed}")
        for what in ("missing", "extra"):
            for lacking, number in collections.Counter(kind(row) for _, row in result[what]).items():
                allowed = max(0 if self.seed == SEED else 1, paired[lacking] // 50)
                named = [(name, row["event"], row["actors"], row["amplitude_db"]) for name, row in result[what]]
                self.assertLessEqual(number, allowed, msg=f"{lacking} {what}: {named}, seed {self.seed}")
        level = sorted(pair[0] for pair in result["pairs"])
        self.assertLess(level[int(0.95 * count)], 0.01, msg=f"seed {self.seed}")
        self.assertLess(result["worst"]["level_db"], 0.1, msg=f"seed {self.seed}")
        self.assertLess(result["worst"]["range_m"], 1e-5)
        self.assertLess(result["worst"]["azimuth_deg"], 1e-3)

    def test_phase_where_poses_are_exact(self):
        # Fresnel, aperture and conventions at once: the phase at element 0 and the window's centre. The room's mesh has
        # 1e-7 m, which is 3e-4 rad.
        worst = []
        true, other = self.folders("exact")
        for name in sorted(os.listdir(true)):
            for a, b in match(read_paths(os.path.join(true, name)), read_paths(os.path.join(other, name)))[0]:
                worst.append(abs(math.remainder(float(a["phase_rad"]) - float(b["phase_rad"]), 2 * math.pi)))
        self.assertLess(float(np.quantile(worst, 0.9)), 0.02, msg=f"seed {self.seed}")

    def test_scattered_power_by_surface(self):
        measurement = self.measurements["exact"]
        ratios = []
        for station in measurement.stations:
            scatter = measurement.tracer.diffuse(station.true)
            ours = {}
            for actor, amplitude in zip(scatter.actor, scatter.amplitude):
                name = measurement.room.actors[actor].name
                ours[name] = ours.get(name, 0.0) + amplitude**2
            theirs = {}
            with open(os.path.join(self.folders("exact")[1], station.name + ".csv"), encoding="ascii") as lines:
                for row in csv.DictReader(lines):
                    if row["event"] == "diffuse":
                        theirs[row["actors"]] = theirs.get(row["actors"], 0.0) + 10**(float(row["amplitude_db"]) / 10)
            total = sum(ours.values())
            ratios += [10 * math.log10(theirs.get(name, 1e-30) / power)
                       for name, power in ours.items() if power > 0.1 * total]
        self.assertGreater(len(ratios), 12)
        self.assertLess(abs(float(np.median(ratios))), 0.1, msg=f"seed {self.seed}")
        self.assertLess(float(np.quantile(np.abs(ratios), 0.9)), 0.7, msg=f"seed {self.seed}")

    def test_samples_agree_without_rough_surfaces(self):
        # Specular paths and corners alone: all phases are known, so the samples themselves agree up to one gain.
        session, other = (os.path.join(self.directory.name, name) for name in ("exact_session", "smooth"))
        twin = os.path.join(session, "smooth.yaml")
        with open(twin, "w", encoding="ascii") as out:
            out.write("scene: scene.yaml\nradar: radar.yaml\nmechanisms:\n  specular: {max_bounces: 3}\n  corner: {}\n")
        run = subprocess.run([PROGRAM, session, "--twin", twin, "--output", other, "--noise", "none"], capture_output=True,
                             text=True, check=False)
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        with open(os.path.join(other, "session.yaml"), encoding="ascii") as file:
            gain_db = float(re.search(r"gain_db: *(\S+)", file.read()).group(1))
        measurement = self.measurements["exact"]
        worst = {}
        for station in measurement.stations:
            x = measurement.radar.grid(*path_arrays(measurement.tracer.specular(station.true), 8))
            raw = np.fromfile(os.path.join(other, "captures", station.name + ".bin"), "<i2").astype(float)
            raw = raw.reshape(2, 64, 2, 4)
            y = (raw[:, :, 0, :] + 1j * raw[:, :, 1, :]).transpose(0, 2, 1).reshape(8, 64) / 32768 / 10**(gain_db / 20)
            error = float(np.linalg.norm(y - x) / np.linalg.norm(x))
            worst[station.location] = max(worst.get(station.location, 0.0), error)
        # One place, with all its headings, may hang on a grazing ray; quantisation and the mesh's 0.1 um leave 1 %.
        self.assertLess(sorted(worst.values())[-2], 0.03, msg=f"seed {self.seed}: {worst}")


# One class for each seed: the usual one and, in a long run, that of the day.
for number in seeds(SEED):
    name = f"Simulated{number}"
    globals()[name] = unittest.skipIf(PROGRAM is None, "mmradartwin_sim simulate is not built in this workspace")(
        type(name, (Simulated, unittest.TestCase), {"seed": number, "__doc__": Simulated.__doc__}))


if __name__ == "__main__":
    unittest.main()
