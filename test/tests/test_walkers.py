"""Who walks: speed, sign and way of points that cross frames of many loops, from bytes that know only distances."""
import math
import unittest

import numpy as np

from diagnose_program import PROGRAM, diagnose
from in_folder import InFolder
from walking_points import Recording, write_session


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class Walkers(InFolder):
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

    def test_where_nobody_walks_nobody_is_found(self):
        for frames, loops in ((6, 48), (60, 16)):
            self.walkers([Recording(frames, loops, seed=9).stands(5.0, -10, 4000).stands(2.0, 30, 3000)], 0)


if __name__ == "__main__":
    unittest.main()
