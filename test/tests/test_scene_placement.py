"""What the programs say where poses and scene do not share one map: an error that names the cause, and no figure of an
empty simulation."""
import os
import subprocess
import unittest

import numpy as np

from mmradartwin_tests.campaign import quaternion as quaternion_of
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.session import Measurement, Settings
from diagnose_program import PROGRAM, diagnose
from in_folder import InFolder

# What a table or a comparison with an empty map would hold.
FIGURES = ("Q1", "Q2", "conjugated", "explained")


class PlacedSession(InFolder):
    """A session of the generator, and what may be changed about its map."""

    poses = 4

    def setUp(self):
        super().setUp()
        self.session = self.at("session")
        Measurement(Settings(output=self.session, seed=7, poses=self.poses, frames=2)).run()

    def change_poses(self, change):
        """Rewrites poses.csv; change takes and returns position and quaternion (x, y, z, w) of a row."""
        file = os.path.join(self.session, "poses.csv")
        with open(file, encoding="ascii") as text:
            head, *rows = text.read().splitlines()
        with open(file, "w", encoding="ascii") as out:
            out.write(head + "\n")
            for row in rows:
                fields = row.split(",")
                numbers = np.array([float(v) for v in fields[3:]])
                position, quaternion = change(numbers[:3], numbers[3:])
                out.write(",".join(fields[:3] + [f"{v:.9f}" for v in [*position, *quaternion]]) + "\n")

    def change_transforms(self, change):
        """The same of the pose as a 4 x 4 matrix."""
        def numbers(position, q):
            x, y, z, w = q / np.linalg.norm(q)
            transform = np.eye(4)
            transform[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
            transform[:3, 3] = position
            changed = change(transform)
            return changed[:3, 3], quaternion_of(changed[:3, :3])
        self.change_poses(numbers)


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class ScenePlacement(PlacedSession):
    def change_vertices(self, change):
        file = os.path.join(self.session, "office.obj")
        with open(file, encoding="ascii") as text:
            lines = text.read().splitlines()
        with open(file, "w", encoding="ascii") as out:
            for line in lines:
                if line.startswith("v "):
                    line = "v " + " ".join(f"{v:.9g}" for v in change(*(float(v) for v in line.split()[1:4])))
                out.write(line + "\n")

    def state(self, keys):
        """Adds keys to the entry of the mesh in scene.yaml."""
        file = os.path.join(self.session, "scene.yaml")
        with open(file, encoding="ascii") as text:
            scene = text.read()
        self.assertIn("office.obj, ", scene)
        with open(file, "w", encoding="ascii") as out:
            out.write(scene.replace("office.obj, ", "office.obj, " + keys + ", "))

    def run_program(self, package, name, *options):
        output = self.at(name)
        return subprocess.run([find_program(package, name), self.session, "--output", output, *options],
                              capture_output=True, text=True, check=False)

    def refusals(self):
        """What simulate, evaluate and diagnose say; each ends with 2, and none shows a figure."""
        simulate = self.run_program("mmradartwin_sim", "simulate")
        self.assertEqual(simulate.returncode, 2, msg=simulate.stderr)
        self.assertFalse(os.path.exists(self.at("simulate", "session.yaml")))
        evaluate = self.run_program("mmradartwin_attribution", "evaluate", "--no-pictures", "--no-bag")
        self.assertEqual(evaluate.returncode, 2, msg=evaluate.stderr)
        self.assertFalse(os.path.exists(self.at("evaluate", "report.html")))
        for figure in FIGURES:
            self.assertNotIn(figure, evaluate.stdout)
        status, findings, errors = diagnose(self.session, self.at("diagnose"))
        self.assertEqual(status, 2, msg=errors)
        self.assertIsNone(findings)
        return simulate.stderr, evaluate.stderr, errors

    def expect(self, *parts):
        for text in self.refusals():
            for part in parts:
                self.assertIn(part, text)

    def assert_fits(self):
        done = self.run_program("mmradartwin_sim", "simulate")
        self.assertEqual(done.returncode, 0, msg=done.stderr)

    def test_poses_in_millimetres(self):
        self.change_poses(lambda p, q: (p * 1000, q))
        self.expect("the poses are in mm", "in metres")

    def test_poses_in_centimetres(self):
        self.change_poses(lambda p, q: (p * 100, q))
        self.expect("the poses are in cm")

    def test_a_radar_outside(self):
        self.change_poses(lambda p, q: (p + [90, 0, 0], q))
        self.expect("m outside the scene", "origin")

    def test_a_scene_in_millimetres(self):
        self.change_vertices(lambda x, y, z: (1000 * x, 1000 * y, 1000 * z))
        self.expect("the scene is ", "unit: mm")
        self.state("unit: mm")
        self.assert_fits()

    def test_a_scene_in_centimetres_with_y_up(self):
        self.change_vertices(lambda x, y, z: (100 * x, 100 * z, -100 * y))
        self.expect("unit: cm", "up: y")
        self.state("unit: cm, up: y")
        self.assert_fits()

    def test_a_scene_of_a_survey(self):
        self.change_vertices(lambda x, y, z: (x + 451200, y + 5411000, z + 400))
        self.expect("origin: [451200, 5411000, 400]")
        self.state("origin: [451200, 5411000, 400]")
        self.assert_fits()

    def test_an_empty_simulated_session(self):
        self.assert_fits()
        captures = self.at("simulate", "captures")
        for name in os.listdir(captures):
            with open(os.path.join(captures, name), "r+b") as file:
                size = os.path.getsize(file.name)
                file.write(bytes(size))
        run = self.run_program("mmradartwin_attribution", "evaluate", "--no-pictures", "--no-bag", "--simulated",
                               self.at("simulate"))
        self.assertEqual(run.returncode, 2, msg=run.stderr)
        for figure in FIGURES:
            self.assertNotIn(figure, run.stdout)


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class PoseConventions(PlacedSession):
    """Poses that were written in another convention: the diagnosis names it."""

    poses = 12
    OPTICAL = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])    # radar <- z forward, x right
    Y_UP = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])    # y-up map <- map

    def description(self):
        status, findings, errors = diagnose(self.session, self.at("out"))
        if findings is None:
            self.assertEqual(status, 2, msg=errors)
            return errors
        self.assertEqual([f["cause"] for f in findings["findings"]], ["unknown"], msg=errors)
        return findings["findings"][0]["description"]

    def test_captures_of_other_places_match_under_no_convention(self):
        folder = os.path.join(self.session, "captures")
        files = [os.path.join(folder, name) for name in sorted(os.listdir(folder))]
        contents = []
        for file in files:
            with open(file, "rb") as capture:
                contents.append(capture.read())
        for file, content in zip(files, contents[5:] + contents[:5], strict=True):
            with open(file, "wb") as capture:
                capture.write(content)
        text = self.description()
        self.assertIn("nothing matches", text)
        self.assertNotIn("the poses match", text)

    def test_w_first(self):
        self.change_poses(lambda p, q: (p, [q[3], q[0], q[1], q[2]]))
        self.assertIn("if their quaternions are w, x, y, z;", self.description())

    def test_world_to_camera(self):
        self.change_transforms(np.linalg.inv)
        self.assertIn("if they are inverted (T_radar_map, world to camera);", self.description())

    def test_optical_frame(self):
        self.change_transforms(lambda transform: transform @ self.OPTICAL)
        self.assertIn("if their frame is an optical one", self.description())

    def test_y_up(self):
        self.change_transforms(lambda transform: self.Y_UP @ transform)
        self.assertIn("if their map's y axis points up", self.description())

    def test_optical_world_to_camera(self):
        self.change_transforms(lambda transform: np.linalg.inv(transform @ self.OPTICAL))
        self.assertIn("if they are inverted (T_radar_map, world to camera) and their frame is an optical one",
                      self.description())


if __name__ == "__main__":
    unittest.main()
