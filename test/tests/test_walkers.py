"""Who walks: speed, sign and way of points that cross frames of many loops, from bytes that know only distances."""
import csv
import math
import os
import subprocess
import unittest

import numpy as np

from diagnose_program import PROGRAM, diagnose
from in_folder import InFolder
from made_wall import WALL
from mmradartwin_tests.installed_programs import find_program
from walking_points import Recording, polar, write_session

WAVELENGTH_M = 299792458.0 / 77.93e9    # at the middle of the samples

EVALUATE = find_program("mmradartwin_attribution", "evaluate")

SCENE = """meshes:
  - {file: wall.ply}
materials: materials.yaml
actors: {wall: {material: Concrete}}
"""
MATERIALS = """materials:
  Concrete: {model: dielectric, relative_permittivity: 5.24, conductivity_s_per_m: 1.38}
"""


class MadeRecordings(InFolder):
    sessions = 0

    def found(self, recordings, poses=None, scene_files=None):
        self.sessions += 1
        session, output = (self.at(f"{name}{self.sessions}") for name in ("session", "out"))
        write_session(session, recordings, poses, scene_files)
        status, findings, errors = diagnose(session, output)
        self.assertEqual(status, 0, msg=errors)
        for finding in findings["findings"]:
            self.check_widths(finding)
        return findings

    def check_widths(self, finding):
        """No interval has the width zero."""
        for name, parameter in finding["parameters"].items():
            ci95 = parameter.get("ci95") or []
            for low, high in [ci95] if ci95 and not isinstance(ci95[0], list) else ci95:
                self.assertLess(low, high, msg=f"{finding['cause']}: {name}")


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class Walkers(MadeRecordings):
    def walkers(self, recordings, count, poses=None):
        """Parameters of the walkers, who are all that is found."""
        findings = self.found(recordings, poses)
        self.assertEqual([f["cause"] for f in findings["findings"]], ["moving_target"] * count, msg=f"{findings}")
        return [f["parameters"] for f in findings["findings"]]

    def check_speed(self, parameters, radial_m_per_s, speed_m_per_s=None, widest=0.5):
        speed_m_per_s = abs(radial_m_per_s) if speed_m_per_s is None else speed_m_per_s
        for name, true in (("speed_m_per_s", speed_m_per_s), ("radial_m_per_s", radial_m_per_s)):
            low, high = parameters[name]["ci95"]
            self.assertTrue(low <= true <= high, msg=f"{name}: {low} to {high}, not {true}")
            self.assertLess(high - low, widest)
            self.assertTrue(low <= parameters[name]["value"] <= high)
        if abs(radial_m_per_s) > 0.1:
            self.assertGreater(radial_m_per_s * parameters["radial_m_per_s"]["ci95"][0], 0)
            self.assertGreater(radial_m_per_s * parameters["radial_m_per_s"]["ci95"][1], 0)

    def test_six_frames_of_many_loops_show_speed_and_sign(self):
        for number, speed in enumerate((0.3, 0.5, 0.8, 1.2, 1.6, -0.3, -0.8, -1.6)):
            recording = Recording(6, 48, seed=number)
            recording.stands(5.0, -10, 400).stands(2.0, 30, 300).walks(3.0, -25, speed, 150)
            walker, = self.walkers([recording], 1)
            with self.subTest(speed=speed):
                self.check_speed(walker, speed)
                middle_m = 3.0 + speed * 0.125
                self.assertAlmostEqual(math.hypot(walker["x_m"]["value"], walker["y_m"]["value"]), middle_m, delta=0.1)

    def test_who_crosses_many_range_bins_has_a_track(self):
        for number, speed in enumerate((1.0, -1.0)):
            begin_m = 3.0 if speed > 0 else 6.0
            recording = Recording(60, 16, seed=number + 20)
            recording.stands(7.5, 0, 400).stands(1.0, 20, 300).walks(begin_m, -25, speed, 20)
            walker, = self.walkers([recording], 1)
            with self.subTest(speed=speed):
                self.check_speed(walker, speed, widest=0.15)
                time_s, x_m, y_m = (np.array(walker[f"track_{name}"]["value"]) for name in ("time_s", "x_m", "y_m"))
                self.assertGreater(len(time_s), 50)
                np.testing.assert_allclose(np.hypot(x_m, y_m), begin_m + speed * time_s, atol=0.08)
                np.testing.assert_allclose(np.degrees(np.arctan2(y_m, x_m)), -25, atol=1.5)

    def test_a_faint_walker_leaves_a_wider_interval(self):
        recording = Recording(30, 16, noise=30, seed=5)
        recording.stands(7.5, 0, 400).stands(1.0, 30, 300).walks(3.0, -25, 0.9, 6)
        walker, = self.walkers([recording], 1)
        self.check_speed(walker, 0.9)

    def test_two_who_walk_at_once(self):
        recording = Recording(6, 48, seed=6)
        recording.stands(5.0, -10, 400).stands(2.0, 30, 300)
        recording.walks(3.0, -25, 0.7, 150).walks(4.2, 20, -1.1, 100)
        for walker in self.walkers([recording], 2):
            self.check_speed(walker, 0.7 if walker["y_m"]["value"] < 0 else -1.1)

    def test_two_whose_ways_cross_in_range(self):
        recording = Recording(60, 16, seed=7)
        recording.stands(7.5, 0, 400).stands(1.0, 30, 300)
        recording.walks(2.5, -25, 0.9, 60).walks(5.5, 15, -0.8, 50)
        for walker in self.walkers([recording], 2):
            self.check_speed(walker, 0.9 if walker["y_m"]["value"] < 0 else -0.8)

    def test_who_crosses_the_view_is_no_slower(self):
        recording = Recording(30, 16, seed=8)
        recording.stands(7.5, 0, 400).stands(1.0, 30, 300)
        t = recording.times_s
        recording.moves(np.stack([3 + 0 * t, t - 0.75, 0 * t], axis=-1), 100)
        walker, = self.walkers([recording], 1)
        self.check_speed(walker, 0.0, speed_m_per_s=1.0)

    def test_seven_poses_see_one_person(self):
        recordings, poses = [], []
        for i in range(7):
            x_m, begin_s = -0.5 + 0.2 * i, 3.0 * i
            recording = Recording(20, 16, seed=30 + i)
            recording.stands(5.0 - x_m, -10, 400).stands(2.2, 30, 300)
            # To and fro between 2.5 and 4.5 m; in the fifth pose he turns.
            way_m = (0.8 * (recording.times_s + begin_s)) % 4.0
            x = 2.5 + np.where(way_m < 2, way_m, 4 - way_m)
            recording.moves(np.stack([x - x_m, 0.6 + 0 * x, 0 * x], axis=-1), 80)
            recordings.append(recording)
            poses.append((f"{i:02d}", x_m, 0.0, 0.0, 1760000000.0 + begin_s))
        walker, = self.walkers(recordings, 1, poses)
        low, high = walker["speed_m_per_s"]["ci95"]
        self.assertTrue(low <= 0.8 <= high, msg=f"{low} to {high}")

    def test_whole_turns_between_loops_are_told_by_the_way_or_not_at_all(self):
        # Loops of 0.8 ms: speeds 2.4 m/s apart look alike in each of them.
        for number, (frames, speed) in enumerate(((30, 1.5), (6, -1.3), (2, 1.0))):
            recording = Recording(frames, 16, seed=number + 50, chirp_s=400e-6)
            recording.stands(5.0, -10, 400).stands(2.0, 30, 300).walks(3.0, -25, speed, 30)
            walker, = self.walkers([recording], 1)
            with self.subTest(frames=frames, speed=speed):
                told = walker["speed_m_per_s"]["value"] is not None
                self.assertEqual(told, "ci95" in walker["speed_m_per_s"])
                self.assertTrue(told or frames == 2)
                if walker["radial_m_per_s"]["value"] is None:
                    self.assertEqual(frames, 2)
                    continue
                if told:
                    low, high = walker["speed_m_per_s"]["ci95"]
                    self.assertTrue(low <= abs(speed) <= high, msg=f"{low} to {high}")
                low, high = walker["radial_m_per_s"]["ci95"]
                self.assertTrue(low <= speed <= high, msg=f"{low} to {high}")

    def test_frames_of_few_loops_show_who_crosses_the_room(self):
        for number, (frames, loops) in enumerate(((60, 1), (60, 3), (100, 2))):
            recording = Recording(frames, loops, seed=number + 60)
            recording.stands(7.5, 0, 400).stands(1.0, 30, 300)
            recording.walks(2.5, -25, 0.9, 60).walks(5.5, 15, -0.8, 50)
            with self.subTest(frames=frames, loops=loops):
                for walker in self.walkers([recording], 2):
                    self.check_speed(walker, 0.9 if walker["y_m"]["value"] < 0 else -0.8)

    def test_nobody_walks_behind_a_wall(self):
        # A sheet across x = 5.22 m; from the same bytes, with and without a scene.
        files = {"wall.ply": WALL, "scene.yaml": SCENE, "materials.yaml": MATERIALS}
        for range_m, in_room in ((3.0, True), (6.6, False)):
            recording = Recording(20, 16, seed=70).stands(5.22, 0, 400).walks(range_m, 5, 0.6, 60)
            findings = self.found([recording], scene_files=files)
            causes = [f["cause"] for f in findings["findings"]]
            with self.subTest(range_m=range_m):
                self.assertEqual(causes.count("moving_target"), int(in_room), msg=f"{findings}")
                if not in_room:
                    self.assertIn("hides", findings["findings"][-1]["description"])
        walker, = self.walkers([Recording(20, 16, seed=70).stands(5.22, 0, 400).walks(6.6, 5, 0.6, 60)], 1)
        self.check_speed(walker, 0.6)

    def test_where_nobody_walks_nobody_is_found(self):
        for frames, loops in ((6, 48), (60, 16)):
            self.walkers([Recording(frames, loops, seed=9).stands(5.0, -10, 4000).stands(2.0, 30, 3000)], 0)


@unittest.skipIf(EVALUATE is None, "mmradartwin_attribution evaluate is not built in this workspace")
class ComparedMaps(InFolder):
    """A wall that the twin has, and a walker whose echo is as strong in the average."""

    def residual_ranges_m(self, loops, walker_amplitude):
        recording = Recording(1, loops, seed=7, chirp_s=500e-6)
        recording.stands(5.22, 0, 400).walks(3.0, -25, 0.66, walker_amplitude)
        session, output = self.at(f"session{loops}_{walker_amplitude}"), self.at(f"out{loops}_{walker_amplitude}")
        write_session(session, [recording], scene_files={"wall.ply": WALL, "scene.yaml": SCENE,
                                                         "materials.yaml": MATERIALS})
        done = subprocess.run([EVALUATE, session, "--output", output, "--quiet"], capture_output=True, text=True,
                              check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(os.path.join(output, "residuals.csv"), encoding="utf-8") as file:
            return [float(row["range_m"]) for row in csv.DictReader(file) if row["stronger"] == "measured"]

    def test_walkers_are_not_compared_where_frames_tell_speeds(self):
        self.assertEqual(self.residual_ranges_m(16, 4000), [])
        # In frames of four loops nothing tells the same walker from a cabinet.
        found_m = self.residual_ranges_m(4, 1500)
        self.assertTrue(found_m)
        for range_m in found_m:
            self.assertAlmostEqual(range_m, 3.0, delta=0.16)


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class FrameLaws(MadeRecordings):
    """What stands changes from frame to frame by a law: nobody walks."""
    ROOM = ((1.3, 35, 300), (2.2, -40, 250), (3.1, 10, 200), (4.0, -20, 220), (6.3, 25, 150), (7.6, -5, 180))

    def room(self, frames, loops, seed, common=None, wall=1.0, x_m=0.0):
        """Points of a room and a wall across x = 5 m, seen from (x_m, 0); common: factor of all echoes by range."""
        common = common or (lambda range_m: 1.0)
        recording = Recording(frames, loops, seed=seed)
        for range_m, azimuth_deg, amplitude in self.ROOM:
            x, y, _ = polar(range_m, azimuth_deg) - [x_m, 0, 0]
            recording.stands(math.hypot(x, y), math.degrees(math.atan2(y, x)), amplitude, common(math.hypot(x, y)))
        return recording.stands(5.0 - x_m, 0, 600, wall * common(5.0 - x_m))

    def law(self, make, frames, loops, count):
        """Parameters of the one law that is found at `count` poses; make: frames of a pose by number and x_m."""
        recordings = [make(i, 0.25 * i) for i in range(count)]
        poses = [(f"{i:02d}", 0.25 * i, 0.0, 0.0, 1760000000.0 + 10 * i) for i in range(count)]
        findings = self.found(recordings, poses)
        self.assertEqual(findings["verdict"], "unknown", msg=f"{findings}")
        finding, = findings["findings"]
        return finding

    def each_shape(self, check, *arguments):
        """Frames, loops and poses."""
        for shape in ((60, 1, 1), (24, 16, 1), (40, 2, 3)):
            with self.subTest(shape=shape):
                check(*shape, *arguments)

    def check_rms(self, finding, name, true):
        low, high = finding["parameters"][name]["ci95"]
        self.assertTrue(0.85 * low <= true <= 1.15 * high, msg=f"{name}: {low} to {high}, not {true}")

    def check_law(self, finding, law):
        self.assertEqual(finding["parameters"]["law"]["value"], law, msg=f"{finding}")

    def check_vibrating(self, frames, loops, count):
        t = np.arange(frames)[:, None, None] * 0.05

        def make(i, x_m):
            way_m = 2e-4 * np.sin(2 * math.pi * 3.1 * t + i)
            return self.room(frames, loops, i, wall=np.exp(4j * math.pi / WAVELENGTH_M * way_m), x_m=x_m)
        finding = self.law(make, frames, loops, count)
        self.check_law(finding, "phase_over_frames_of_one_echo")
        self.check_rms(finding, "phase_rms_rad", 4 * math.pi / WAVELENGTH_M * 2e-4 / math.sqrt(2))
        self.assertEqual(len(finding["where"]), count)
        for place in finding["where"]:
            self.assertAlmostEqual(place["x_m"], 5.0, delta=0.15)

    def test_a_wall_that_vibrates(self):
        self.each_shape(self.check_vibrating)

    def check_trigger(self, frames, loops, count):
        rng = np.random.default_rng(frames + count)
        per_m_s = 2 * math.pi * 75e12 * 2 / 299792458.0

        def make(i, x_m):
            late_s = rng.normal(0, 8e-9, frames)[:, None, None]
            return self.room(frames, loops, i, lambda range_m: np.exp(1j * per_m_s * range_m * late_s), x_m=x_m)
        finding = self.law(make, frames, loops, count)
        self.check_law(finding, "phase_over_frames_growing_with_range")
        self.check_rms(finding, "phase_rms_rad_per_m", per_m_s * 8e-9)

    def test_a_trigger_that_jitters(self):
        self.each_shape(self.check_trigger)

    def check_phase(self, frames, loops, count):
        rng = np.random.default_rng(frames + count)

        def make(i, x_m):
            phase = rng.normal(0, 0.4, frames)[:, None, None]
            return self.room(frames, loops, i, lambda range_m: np.exp(1j * phase), x_m=x_m)
        finding = self.law(make, frames, loops, count)
        self.check_law(finding, "phase_over_frames_of_all_echoes")
        self.check_rms(finding, "phase_rms_rad", 0.4)

    def test_a_phase_that_all_echoes_share(self):
        self.each_shape(self.check_phase)

    def check_level(self, frames, loops, count, law):
        rng = np.random.default_rng(frames + count)

        def make(i, x_m):
            level = 10**(rng.normal(0, 1.0, frames)[:, None, None] / 20)
            if law.endswith("one_echo"):
                return self.room(frames, loops, i, wall=level, x_m=x_m)
            return self.room(frames, loops, i, lambda range_m: level, x_m=x_m)
        finding = self.law(make, frames, loops, count)
        if law.endswith("all_echoes") and "law" not in finding["parameters"]:    # frame by frame, of all poses
            self.assertIn("common level of frames", finding["description"])
            return
        self.check_law(finding, law)
        self.check_rms(finding, "level_rms_db", 1.0)

    def test_a_level_that_all_echoes_share(self):
        self.each_shape(self.check_level, "level_over_frames_of_all_echoes")

    def test_a_level_that_one_echo_has(self):
        self.each_shape(self.check_level, "level_over_frames_of_one_echo")


if __name__ == "__main__":
    unittest.main()
