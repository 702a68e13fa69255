"""calibrate against the generator: a hidden mount, range bias and channel errors, found from a few poses."""
import math
import os
import subprocess
import tempfile
import unittest

import numpy as np
import yaml

from mmradartwin_tests.campaign import Station, rotation_from_vector
from mmradartwin_tests.effects import make_effect
from mmradartwin_tests.effects.effect import Effect
from mmradartwin_tests.geometry import rotation_z
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.session import Measurement, Settings
from mmradartwin_tests.tracing import Path, Pose

PROGRAM = find_program("mmradartwin_attribution", "calibrate")
EVALUATE = find_program("mmradartwin_attribution", "evaluate")
PROCESS = find_program("mmradartwin_dsp", "process")
HIDDEN = {"yaw_deg": 1.7, "forward_m": 0.030, "left_m": -0.040, "range_m": 0.025}
PHASE_DEG = [0, 12, -8, 5, 20, -15, 9, -4]
GAIN_DB = [0, 0.6, -0.4, 0.2, -0.8, 0.5, 0.3, -0.6]
REFLECTOR = np.array([4.4, 3.1, 1.2])
# Where the radar is held before each: corners of a box; the bearing of the surface; its coordinate y.
WALLS = {"whiteboard": ((2.55, 3.6, 1.1), (3.15, 4.8, 1.7), math.pi / 2, 5.95),
         "wall_south": ((2.9, 1.0, 1.0), (4.6, 2.4, 1.4), -math.pi / 2, 0.0),
         "wall_north": ((3.7, 4.0, 1.1), (4.9, 5.1, 1.7), math.pi / 2, 6.0)}
RCS_M2 = 4 * math.pi * 0.2**4 / (3 * 0.003847**2)   # trihedral of 20 cm


class CalibrationPoses(Effect):
    """The campaign's poses are replaced by ones before the target; with a corner reflector its echo is added."""
    name, rank = "calibration_poses", 0
    defaults = {"count": 8, "wall": None, "sigma_m": 0.0, "sigma_deg": 0.0, "reflector": True, "span_deg": 80}

    def prepare(self, measurement):
        rng, room = measurement.rng(900), measurement.described_room
        measurement.stations.clear()
        while len(measurement.stations) < self.p["count"]:
            i = len(measurement.stations)
            offset = math.radians(self.p["span_deg"] * ((i + 0.5) / self.p["count"] - 0.5))
            if self.p["wall"]:
                low, high, bearing, _ = WALLS[self.p["wall"]]
                place = rng.uniform(low, high)
            else:
                bearing = rng.uniform(0, 2 * math.pi)
                ray = rng.uniform(1.2, 2.4) * np.array([math.cos(bearing), math.sin(bearing), 0])
                place = REFLECTOR - ray + np.array([0, 0, rng.uniform(-0.1, 0.1)])
            if room.inside(place) or room.clearance(place) < 0.3:
                continue
            if not self.p["wall"] and not room.visible(place, REFLECTOR)[0]:
                continue
            true = Pose(place, rotation_z(bearing + offset))
            error = rotation_from_vector(np.radians([0, 0, self.p["sigma_deg"] * rng.standard_normal()]))
            reported = Pose(place + self.p["sigma_m"] * rng.standard_normal(3), true.rotation @ error)
            stamp = (1760000000 + 10 * i) * 10**9
            measurement.stations.append(Station(f"{i + 1:03d}", "01", stamp, true, reported))

    def echoes(self, measurement, station, echoes):
        if self.p["wall"] or not self.p["reflector"]:
            return
        ray = REFLECTOR - station.true.position
        r = np.linalg.norm(ray)
        level = measurement.radar.wavelength_m * math.sqrt(RCS_M2) / ((4 * math.pi)**1.5 * r**2)
        lengths = measurement.tracer.point_lengths(station.true, REFLECTOR[None])[0]
        echoes.add([Path("specular", (-1,), (0,), REFLECTOR[None], ray / r, ray / r, float(2 * r), complex(level), lengths,
                         (1.0,))])


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution calibrate is not built in this workspace")
class Calibrated(unittest.TestCase):
    """Sessions with everything hidden at once, of exact and of inexact poses."""

    @classmethod
    def setUpClass(cls):
        cls.directory = tempfile.TemporaryDirectory()
        cls.seed = int(os.environ.get("MMRADARTWIN_CALIBRATION_SEED", "1"))
        cls.measured = {}

    @classmethod
    def tearDownClass(cls):
        cls.directory.cleanup()

    def session(self, name, alone=False, clean=False, **poses):
        """The measurement of a session, made once. `alone`: channel errors only; `clean`: none hidden."""
        if name not in self.measured:
            effects = [CalibrationPoses(**poses), make_effect("radar_yaw_offset", {"yaw_deg": HIDDEN["yaw_deg"]}),
                       make_effect("radar_position_offset",
                                   {key: HIDDEN[key] for key in ("forward_m", "left_m")}),
                       make_effect("range_bias", {"range_m": HIDDEN["range_m"]}),
                       make_effect("channel_phase_error", {"phase_deg": PHASE_DEG, "gain_db": GAIN_DB})]
            # The position is in the reported radar frame: it acts before the yaw.
            effects[1], effects[2] = effects[2], effects[1]
            effects = effects[:1] if clean else [effects[0], effects[-1]] if alone else effects
            measurement = Measurement(Settings(output=os.path.join(self.directory.name, name), seed=self.seed, poses=1,
                                               frames=20, tier="exact", jobs=1, effects=effects))
            measurement.run()
            self.measured[name] = measurement
        return self.measured[name]

    def calibrate(self, measurement, *arguments):
        """Exit status, calibration.yaml, twin.yaml, stderr."""
        self.output = output = os.path.join(self.directory.name, f"out{len(os.listdir(self.directory.name))}")
        run = subprocess.run([PROGRAM, measurement.settings.output, "--output", output, *map(str, arguments)],
                             capture_output=True, text=True, check=False)
        results = []
        for name in ("calibration.yaml", "twin.yaml"):
            path = os.path.join(output, name)
            results.append(None)
            if os.path.exists(path):
                with open(path, encoding="utf-8") as file:
                    results[-1] = yaml.safe_load(file)
        if results[0]:
            self.assertGreater(os.path.getsize(os.path.join(output, "calibration.png")), 1000)
        return run.returncode, results[0], results[1], run.stderr

    def lasers(self, measurement, wall=None, **wrong):
        """CSV of laser distances to the reflector or to a wall, 0.5 mm of noise."""
        rng = measurement.rng(901)
        path = os.path.join(self.directory.name, f"laser{len(os.listdir(self.directory.name))}.csv")
        with open(path, "w", encoding="ascii") as out:
            out.write("pose,distance_m\n")
            for s in measurement.stations:
                d = (abs(s.true.position[1] - WALLS[wall][3]) if wall else
                     np.linalg.norm(REFLECTOR - s.true.position)) + 0.0005 * rng.standard_normal()
                out.write(f"{s.name},{d + wrong.get('p' + s.name, 0):.4f}\n")
        return path

    def pointing_errors_deg(self, found):
        """How far off echoes from 35 deg right to 35 deg left come to stand in map with the found yaw and phases."""
        phases = [v["value"] for v in found["channel_phase_error"]["phase_deg"]]
        left = np.exp(1j * np.radians(np.array(PHASE_DEG) - phases))
        beams = np.radians(np.arange(-45, 45, 0.01))
        steering = np.exp(1j * np.pi * np.outer(np.sin(beams), np.arange(8)))
        errors = []
        for azimuth in np.radians([-35, -15, 0, 15, 35]):
            seen = beams[np.abs(steering @ (left * np.exp(-1j * np.pi * np.arange(8) * np.sin(azimuth)))).argmax()]
            errors.append(np.degrees(seen - azimuth) + found["radar_yaw_offset"]["yaw_deg"]["value"] - HIDDEN["yaw_deg"])
        return np.array(errors)

    def expect(self, found, limits, share=1.0, pointing_deg=0.15, phase_deg=4.0, gain_db=0.5):
        """Values within their limits, and the truth within the stated intervals.

        Yaw and a phase that grows evenly over the channels differ by the cosine of the azimuth alone, so that neither is
        as certain as what both do to a direction: that has a limit of its own.
        """
        values = {"yaw_deg": found["radar_yaw_offset"]["yaw_deg"], **found["radar_position_offset"],
                  "range_m": found["range_bias"]["range_m"]}
        inside = []
        for key, limit in limits.items():
            self.assertLess(abs(values[key]["value"] - HIDDEN[key]), limit, msg=f"{key}, seed {self.seed}")
            low, high = values[key]["ci95"]
            margin = 0.5 * (high - low)   # 1 in 20 may lie outside; none by much
            self.assertTrue(low - margin <= HIDDEN[key] <= high + margin,
                            msg=f"{key} {HIDDEN[key]} not in {low} to {high}, seed {self.seed}")
            inside.append(low <= HIDDEN[key] <= high)
            self.assertLess(high - low, 12 * limit, msg=f"{key}: the interval says nothing")
        self.assertGreaterEqual(np.mean(inside), share)
        self.assertLess(np.abs(self.pointing_errors_deg(found)).max(), pointing_deg, msg=f"seed {self.seed}")
        channel = np.arange(8)
        for key, truth, limit in (("phase_deg", PHASE_DEG, phase_deg), ("gain_db", GAIN_DB, gain_db)):
            wrong = np.array([v["value"] for v in found["channel_phase_error"][key]]) - truth
            wrong -= np.polyval(np.polyfit(channel, wrong, 1), channel)
            self.assertLess(np.abs(wrong).max(), limit, msg=f"{key} {wrong}, seed {self.seed}")

    REFLECTOR_OPTIONS = ("--reflector", *REFLECTOR)

    def test_reflector_with_laser_distances(self):
        measurement = self.session("reflector")
        status, found, twin, errors = self.calibrate(measurement, *self.REFLECTOR_OPTIONS, "--laser",
                                                     self.lasers(measurement))
        self.assertEqual(status, 0, msg=errors)
        self.expect(found, {"yaw_deg": 0.15, "forward_m": 0.0015, "left_m": 0.0015, "range_m": 0.0015}, share=0.75)
        mechanisms = twin["mechanisms"]
        self.assertEqual(mechanisms["radar_yaw_offset"]["yaw_deg"], found["radar_yaw_offset"]["yaw_deg"]["value"])
        self.assertEqual(len(mechanisms["channel_phase_error"]["phase_deg"]), 8)
        for pose in found["poses"]:
            self.assertLess(abs(pose["range_error_m"][1]), 0.005)
            self.assertLess(abs(pose["azimuth_error_deg"][1]), 0.5)

    def test_reflector_without_laser_distances(self):
        status, found, twin, errors = self.calibrate(self.session("reflector"), *self.REFLECTOR_OPTIONS, "--channels",
                                                     "none")
        self.assertEqual(status, 0, msg=errors)
        self.expect(found, {"yaw_deg": 0.3, "forward_m": 0.01, "left_m": 0.01, "range_m": 0.01}, share=0.75)
        self.assertNotIn("channel_phase_error", twin["mechanisms"])

    def test_reported_poses_that_are_a_little_off(self):
        measurement = self.session("noisy", count=12, sigma_m=0.002, sigma_deg=0.1)
        status, found, _, errors = self.calibrate(measurement, *self.REFLECTOR_OPTIONS, "--laser",
                                                  self.lasers(measurement))
        self.assertEqual(status, 0, msg=errors)
        self.expect(found, {"yaw_deg": 1.2, "forward_m": 0.006, "left_m": 0.006, "range_m": 0.002}, share=0.5,
                    pointing_deg=0.2)

    def test_metal_board(self):
        measurement = self.session("board", wall="whiteboard", count=10, span_deg=100)
        status, found, _, errors = self.calibrate(measurement, "--wall", "whiteboard", "--laser",
                                                  self.lasers(measurement, wall="whiteboard"))
        self.assertIn(status, (0, 2), msg=errors)
        self.assertIsNotNone(found, msg=errors)
        self.assertGreaterEqual(sum(p["used"] for p in found["poses"]), 6, msg=errors)
        self.expect(found, {"yaw_deg": 0.6, "forward_m": 0.003, "left_m": 0.003, "range_m": 0.004}, share=0.5,
                    pointing_deg=0.2)

    def test_wall_behind_a_window(self):
        """The window's echo comes from 5 cm before the wall's place, in the same range cell: it is not taken for it."""
        status, found, _, errors = self.calibrate(self.session("window", wall="wall_south", count=4), "--wall",
                                                  "wall_south")
        self.assertEqual(status, 2, msg=errors)
        self.assertIsNone(found)
        self.assertIn("0 of 4 poses show wall_south", errors)
        self.assertIn("'window' stands before wall_south", errors)

    def test_concrete_wall(self):
        """Its speckle turns the echo at every pose: what so few poses leave open is said, and written nowhere."""
        measurement = self.session("concrete", wall="wall_north", count=5)
        status, found, twin, errors = self.calibrate(measurement, "--wall", "wall_north", "--laser",
                                                     self.lasers(measurement, wall="wall_north"), "--channels",
                                                     "measured")
        self.assertEqual(status, 2, msg=errors)
        if found is None:  # fewer than three of these poses have the wall's echo alone
            self.assertIn("needs three or more", errors)
            self.skipTest(f"seed {self.seed} leaves too few poses")
        self.assertIn("wall_north determines neither yaw nor channel errors", errors)
        self.assertIn("metal board", errors)
        self.assertIsNone(found["radar_yaw_offset"]["yaw_deg"]["ci95"])
        self.assertIn("not used", found["radar_yaw_offset"]["yaw_deg"]["note"])
        self.assertEqual([v["value"] for v in found["channel_phase_error"]["phase_deg"]], [0] * 8)
        self.assertFalse({"radar_yaw_offset", "channel_phase_error"} & set(twin["mechanisms"]))
        self.assertFalse(os.path.exists(os.path.join(self.output, "channels.yaml")))
        # What a laser fixes is fixed before any wall.
        self.assertLess(abs(found["radar_position_offset"]["forward_m"]["value"] - HIDDEN["forward_m"]), 0.01)

    def test_measured_branch_is_corrected(self):
        """Channel errors alone: what calibrate writes takes them out of the maps, and a twin must not have them too."""
        hidden, clean = self.session("channels", alone=True), self.session("clean", clean=True)
        status, found, twin, errors = self.calibrate(hidden, *self.REFLECTOR_OPTIONS, "--laser", self.lasers(hidden),
                                                     "--channels", "measured")
        self.assertEqual(status, 0, msg=errors)
        self.assertNotIn("channel_phase_error", twin["mechanisms"])
        channels = os.path.join(self.output, "channels.yaml")
        with open(channels, encoding="utf-8") as file:
            written = yaml.safe_load(file)
        self.assertEqual(written["phase_deg"], [v["value"] for v in found["channel_phase_error"]["phase_deg"]])
        self.assertEqual(written["gain_db"], [v["value"] for v in found["channel_phase_error"]["gain_db"]])

        def maps(measurement, *more):
            folder = os.path.join(self.directory.name, f"maps{len(os.listdir(self.directory.name))}")
            subprocess.run([PROCESS, measurement.settings.output, "--output", folder, *more], check=True,
                           capture_output=True)
            return [np.loadtxt(os.path.join(folder, "maps", f"{s.name}.csv"), delimiter=",", skiprows=1)
                    for s in measurement.stations]

        wanted, raw, corrected = maps(clean), maps(hidden), maps(hidden, "--channels", channels)

        def mean_difference_db(got):
            """Over cells beyond the near range and within 60 deg, above -20 dB of each map's peak; levels are free."""
            differences = []
            for a, b in zip(got, wanted):
                inside = (b[:, 0] > 0.3) & (np.abs(b[:, 1]) < 60)
                strong = inside & (b[:, 2] > b[inside, 2].max() - 20)
                differences.append((a[:, 2] - b[:, 2])[strong])
            differences = np.concatenate(differences)
            return np.abs(differences - np.median(differences)).mean()

        self.assertLess(mean_difference_db(corrected), 0.35)
        self.assertGreater(mean_difference_db(raw), 3 * mean_difference_db(corrected))

        # The twin with the same error is refused; the one without is compared.
        with open(os.path.join(self.output, "both.yaml"), "w", encoding="ascii") as out:
            yaml.safe_dump({"mechanisms": dict(twin["mechanisms"], channel_phase_error={
                "phase_deg": written["phase_deg"], "gain_db": written["gain_db"]})}, out)
        for name, expected in (("both.yaml", 2), ("twin.yaml", 0)):
            run = subprocess.run([EVALUATE, hidden.settings.output, "--channels", channels, "--twin",
                                  os.path.join(self.output, name), "--output", os.path.join(self.output, "report"),
                                  "--no-pictures", "--no-bag"], capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, expected, msg=run.stderr)
            if expected == 2:
                self.assertIn("would count twice", run.stderr)
        # A later run that puts them into the twin leaves no correction behind.
        run = subprocess.run([PROGRAM, hidden.settings.output, "--output", self.output, "--force", *map(
            str, self.REFLECTOR_OPTIONS)], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        self.assertFalse(os.path.exists(channels))

    def test_contradicting_laser_is_named(self):
        measurement = self.session("reflector")
        status, found, _, errors = self.calibrate(measurement, *self.REFLECTOR_OPTIONS, "--laser",
                                                  self.lasers(measurement, p003=0.12))
        self.assertEqual(status, 2)
        self.assertIsNone(found)
        self.assertIn("pose '003'", errors)
        self.assertIn("the laser says", errors)

    def test_what_cannot_be_calibrated_is_refused_with_its_reason(self):
        one = self.session("one", count=1)
        status, _, _, errors = self.calibrate(one, *self.REFLECTOR_OPTIONS)
        self.assertEqual(status, 2)
        self.assertIn("needs three or more", errors)
        good = self.session("reflector")
        # A place behind the walls: no pose can show it.
        status, _, _, errors = self.calibrate(good, "--reflector", 4.4, 3.1, 40)
        self.assertEqual(status, 2)
        self.assertIn("0 of 8 poses show", errors)
        for arguments, words in (((), "either --reflector"), (("--wall", "no_such"), "has no actor 'no_such'"),
                                 (("--wall", "floor"), "no upright surface")):
            status, _, _, errors = self.calibrate(good, *arguments)
            self.assertEqual(status, 2)
            self.assertIn(words, errors)
        csv = os.path.join(self.directory.name, "bad.csv")
        for text, words in (("pose,range\n", "must be pose,distance_m"), ("pose,distance_m\n001,x\n", "line 2"),
                            ("pose,distance_m\n001,2\n001,2\n", "stands twice"),
                            ("pose,distance_m\n999,2\n", "which")):
            with open(csv, "w", encoding="ascii") as out:
                out.write(text)
            status, _, _, errors = self.calibrate(good, *self.REFLECTOR_OPTIONS, "--laser", csv)
            self.assertEqual(status, 2)
            self.assertIn(words, errors)


if __name__ == "__main__":
    unittest.main()
