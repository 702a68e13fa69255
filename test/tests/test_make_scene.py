"""make_scene of degraded scans: frame, planes, things, checks, repeated runs and bad input."""
import math
import os
import re
import subprocess
import unittest

import numpy as np
import yaml

from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.office import build_actors, write_obj
from mmradartwin_tests.scans import known_room, scan_files, scene_comparison
from mmradartwin_tests.scans.degraded_scan import Degradation, Scan, make_scan
from in_folder import InFolder

PROGRAM = find_program("mmradartwin_sim", "make_scene")


def make_scene(*arguments, limit_s=300):
    """(status, standard output, standard error)."""
    done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False, timeout=limit_s)
    return done.returncode, done.stdout, done.stderr


def as_scan(points, faces=None):
    """A Scan of points as they are."""
    return Scan(np.asarray(points, float), None if faces is None else np.asarray(faces), None, np.eye(4), 0.01)


@unittest.skipIf(PROGRAM is None, "make_scene is not built in this workspace")
class DegradedScansBecomeScenes(InFolder):
    def made(self, room, asked, *more):
        """(Measured, standard error) of a scan of a room."""
        scan = make_scan(room, asked, 11)
        scan_files.write_ply(self.at("scan.ply"), scan)
        status, self.told, said = make_scene(self.at("scan.ply"), "--output", self.at("scene"), *more)
        self.assertEqual(status, 0, msg=said)
        return scene_comparison.compare(self.at("scene"), room, scan), said

    def assert_close(self, found, offset_m=0.005, angle_deg=0.2):
        """The issue's bounds on frame and walls."""
        self.assertLess(abs(found.floor_m), 0.005)
        self.assertLess(found.tilt_deg, 0.1)
        self.assertGreater(found.wall_share, 0.9)
        for name, offset, angle in found.walls:
            self.assertLess(offset, offset_m, msg=name)
            self.assertLess(angle, angle_deg, msg=name)

    def assert_sound(self, found):
        """No leak, no body in free air, nothing doubled, no sliver."""
        checks = found.quality["checks"]
        self.assertEqual(checks["through_gaps"], 0)
        self.assertEqual(checks["places_in_bodies"], {})
        self.assertLess(sum(checks["coincident_m2"].values()), 0.05)

    def test_millimetres_y_up_tilted(self):
        """A fused mesh in millimetres, y up, off level by 5 degrees, its floor 1 m below the origin."""
        asked = Degradation("mm", size=150000, noise_m=0.004, smooth_steps=0.7, y_up=True, unit_m=1e-3, tilt_deg=5.0,
                            yaw_deg=20.0, offset_m=(1.0, 2.0, -1.0))
        found, said = self.made(known_room.l_shaped_room(), asked)
        self.assert_close(found)
        self.assert_sound(found)
        self.assertEqual(found.quality["unit_m"], 1e-3)
        self.assertRegex(self.told, "millimetres, y up.* floor 1.00 m below")
        right = [r for _, _, r in found.furniture]
        self.assertGreaterEqual(np.mean(right), 0.8, msg=f"{found.furniture}")

    def test_cloud_with_ghosts_and_blind_glass(self):
        asked = Degradation("cloud", kind="cloud", size=400000, places=6, noise_m=0.005, holes=4, ghosts=0.3, blind_glass=True,
                            yaw_deg=11.0, offset_m=(0.0, 0.0, -1.5))
        found, _ = self.made(known_room.office_room(), asked)
        self.assert_close(found)
        self.assert_sound(found)

    def test_a_wall_at_97_degrees_is_not_turned_to_90(self):
        asked = Degradation("meeting", size=150000, noise_m=0.006, tilt_deg=1.0)
        found, _ = self.made(known_room.tilted_corner_room(), asked)
        self.assert_close(found)

    def test_pictures_and_numbers_stand_beside_the_scene(self):
        asked = Degradation("small", kind="cloud", size=100000)
        self.made(known_room.l_shaped_room(), asked)
        for name in ("scene.yaml", "materials.yaml", "room.obj", "scan.yaml", "quality.yaml", "top_view.png", "residuals.png",
                     "before_after.png"):
            self.assertGreater(os.path.getsize(self.at("scene", name)), 100, msg=name)
        with open(self.at("scene", "top_view.png"), "rb") as picture:
            self.assertEqual(picture.read(8), b"\x89PNG\r\n\x1a\n")

    def test_boxes_alone_leave_the_planes_and_take_fewer_triangles(self):
        asked = Degradation("small", kind="cloud", size=100000)
        self.made(known_room.l_shaped_room(), asked)
        shapes = scene_comparison.read_obj(self.at("scene", "room.obj"))
        self.made(known_room.l_shaped_room(), asked, "--things", "boxes", "--force")
        boxes = scene_comparison.read_obj(self.at("scene", "room.obj"))
        self.assertEqual(sorted(shapes), sorted(boxes))
        things = scene_comparison.read_summary(self.at("scene"))["things"]
        self.assertLessEqual({t["shape"] for t in things}, {"box", "plate", "cylinder"})
        for name in set(shapes) - {t["name"] for t in things}:
            np.testing.assert_array_equal(shapes[name], boxes[name], err_msg=name)
        self.assertLess(sum(map(len, boxes.values())), sum(map(len, shapes.values())))

    def test_same_bytes_again_and_edits_stay(self):
        asked = Degradation("small", kind="cloud", size=100000)
        self.made(known_room.l_shaped_room(), asked)
        text = {}
        for name in ("scene.yaml", "materials.yaml", "room.obj", "scan.yaml", "quality.yaml"):
            with open(self.at("scene", name), encoding="utf-8") as file:
                text[name] = file.read()
        status, _, said = make_scene(self.at("scan.ply"), "--output", self.at("again"))
        self.assertEqual(status, 0, msg=said)
        for name, content in text.items():
            with open(self.at("again", name), encoding="utf-8") as file:
                self.assertEqual(file.read().replace("again", "scene"), content, msg=name)
        # A person says that a wall is of glass; a second run into the same folder keeps that.
        wall = next(n for n in re.findall(r"^o (wall_\d+)", text["room.obj"], re.M))
        edited, count = re.subn(rf'("?{wall}"?: {{material: )\w+', r"\1Glass", text["scene.yaml"])
        if count == 0:
            edited = text["scene.yaml"] + f"\nactors:\n  {wall}: {{material: Glass}}\n"
        with open(self.at("scene", "scene.yaml"), "w", encoding="utf-8") as file:
            file.write(edited)
        status, _, said = make_scene(self.at("scan.ply"), "--output", self.at("scene"), "--force")
        self.assertEqual(status, 0, msg=said)
        with open(self.at("scene", "scene.yaml"), encoding="utf-8") as file:
            self.assertEqual(yaml.safe_load(file)["actors"][wall]["material"], "Glass")

    def test_a_scan_laid_over_itself_gives_each_wall_once(self):
        """What was exported twice, 6 mm apart."""
        room = known_room.l_shaped_room()
        scan = make_scan(room, Degradation("twice", size=80000, noise_m=0.003), 12)
        both = as_scan(np.concatenate([scan.points, scan.points + [0.004, 0.004, 0.002]]),
                       np.concatenate([scan.faces, scan.faces + len(scan.points)]))
        scan_files.write_ply(self.at("twice.ply"), both)
        status, _, said = make_scene(self.at("twice.ply"), "--output", self.at("scene"))
        self.assertEqual(status, 0, msg=said)
        found = scene_comparison.compare(self.at("scene"), room, scan)
        self.assert_close(found, offset_m=0.008)
        self.assert_sound(found)

    def test_points_that_are_no_numbers_are_left_out(self):
        room = known_room.l_shaped_room()
        scan = make_scan(room, Degradation("nan", kind="cloud", size=100000), 13)
        scan.points[::50] = math.nan
        scan_files.write_ply(self.at("nan.ply"), scan)
        status, _, said = make_scene(self.at("nan.ply"), "--output", self.at("scene"))
        self.assertEqual(status, 0, msg=said)
        self.assert_close(scene_comparison.compare(self.at("scene"), room, scan))


@unittest.skipIf(PROGRAM is None, "make_scene is not built in this workspace")
class BadInput(InFolder):
    def assert_refused(self, file, pattern):
        """Status 2, one line that names the file and says what to do, and nothing written."""
        status, out, said = make_scene(file, "--output", self.at("scene"), "--quiet")
        self.assertEqual(status, 2, msg=f"{out}{said}")
        lines = said.strip().splitlines()
        self.assertEqual(len(lines), 1, msg=said)
        self.assertIn(os.path.basename(file), lines[0])
        self.assertRegex(lines[0], pattern)
        self.assertFalse(os.path.exists(self.at("scene")))

    def test_empty_file(self):
        for name in ("empty.ply", "empty.obj", "empty.xyz", "empty.pcd", "empty.stl"):
            open(self.at(name), "wb").close()
            self.assert_refused(self.at(name), "empty|no ")

    def test_two_points(self):
        scan_files.write_ply(self.at("two.ply"), as_scan([[0, 0, 0], [1, 1, 1]]))
        self.assert_refused(self.at("two.ply"), "point")
        scan_files.write_xyz(self.at("two.xyz"), as_scan([[0, 0, 0], [1, 1, 1]]))
        self.assert_refused(self.at("two.xyz"), "point")

    def test_a_plane_alone(self):
        rng = np.random.default_rng(1)
        points = rng.uniform([0, 0, 0], [4, 3, 0], (50000, 3)) + 0.003 * rng.standard_normal((50000, 3))
        scan_files.write_ply(self.at("plane.ply"), as_scan(points))
        self.assert_refused(self.at("plane.ply"), "plane|wall")

    def test_outdoors(self):
        """Rolling ground with trees, 80 m across."""
        rng = np.random.default_rng(2)
        xy = rng.uniform(-40, 40, (300000, 2))
        ground = np.column_stack([xy, 1.5 * np.sin(xy[:, 0] / 9) * np.cos(xy[:, 1] / 7)])
        trees = [np.array([*rng.uniform(-35, 35, 2), 5.0]) + rng.normal(0, 1.2, (4000, 3)) for _ in range(25)]
        scan_files.write_ply(self.at("park.ply"), as_scan(np.concatenate([ground, *trees])))
        self.assert_refused(self.at("park.ply"), "room|wall|floor|outdoors")

    def test_all_vertices_nan(self):
        scan_files.write_ply(self.at("nan.ply"), as_scan(np.full((5000, 3), math.nan)))
        self.assert_refused(self.at("nan.ply"), "number")

    def test_twenty_million_triangles_are_refused_within_memory(self):
        """The file is sparse: what it says of itself is enough."""
        header = ("ply\nformat binary_little_endian 1.0\nelement vertex 10000000\nproperty float x\nproperty float y\n"
                  "property float z\nelement face 20000000\nproperty list uchar int vertex_indices\nend_header\n")
        with open(self.at("huge.ply"), "wb") as out:
            out.write(header.encode("ascii"))
            out.truncate(len(header) + 12 * 10000000 + 13 * 20000000)
        self.assert_refused(self.at("huge.ply"), "million|triangles|decimate")

    def test_text_that_is_no_mesh(self):
        with open(self.at("notes.ply"), "w", encoding="ascii") as out:
            out.write("to do: scan the room\n")
        self.assert_refused(self.at("notes.ply"), "ply|PLY")
        with open(self.at("notes.xyz"), "w", encoding="ascii") as out:
            out.write("to do: scan the room\n")
        self.assert_refused(self.at("notes.xyz"), ".")


@unittest.skipIf(PROGRAM is None, "make_scene is not built in this workspace")
class ObjectScans(InFolder):
    """A cabinet of the office with a scan of its own, in millimetres, beside a coarse scan of the room."""

    def setUp(self):
        super().setUp()
        room = known_room.office_room()
        self.scan = make_scan(room, Degradation("small", kind="cloud", size=200000), 11)
        scan_files.write_ply(self.at("scan.ply"), self.scan)
        self.body = next(a for a in room.furniture if a.name == "cabinet_east").parts[0]
        rng, points = np.random.default_rng(5), []
        for axis in range(3):
            face = rng.uniform(-0.5, 0.5, (6000, 3)) * self.body.size
            face[:, axis] = np.sign(rng.uniform(-1, 1, 6000)) * self.body.size[axis] / 2
            points.append(face)
        points = np.concatenate(points) + 0.001 * rng.standard_normal((18000, 3))
        scan_files.write_ply(self.at("cabinet.ply"), as_scan(1000 * points))

    def objects(self, place, name="steel_cabinet"):
        """Writes objects.yaml: the cabinet's middle at a place, turned as in the office."""
        half = math.atan2(self.body.rotation[1, 0], self.body.rotation[0, 0]) / 2
        pose = [*(float(v) for v in place), 0.0, 0.0, math.sin(half), math.cos(half)]
        entry = {"file": "cabinet.ply", "pose": pose, "frame": "scan", "unit": "mm", "material": "Metal"}
        with open(self.at("objects.yaml"), "w", encoding="utf-8") as out:
            yaml.safe_dump({"objects": {name: entry}}, out)
        return make_scene(self.at("scan.ply"), "--objects", self.at("objects.yaml"), "--output", self.at("scene"))

    def test_a_scanned_object_takes_the_place_of_what_the_room_has_of_it(self):
        status, _, said = self.objects(self.body.center)
        self.assertEqual(status, 0, msg=said)
        made = scene_comparison.read_obj(self.at("scene", "room.obj"))
        quality = scene_comparison.read_summary(self.at("scene"))
        back = np.linalg.inv(scene_comparison.map_from_truth(quality, self.scan))
        corners = made["steel_cabinet"].reshape(-1, 3) @ back[:3, :3].T + back[:3, 3]
        off = np.abs(np.abs((corners - self.body.center) @ self.body.rotation) - self.body.size / 2)
        self.assertLess(off.max(), 0.006)
        for name, triangles in made.items():      # nothing else fills its place
            inside = np.abs((triangles.reshape(-1, 3) @ back[:3, :3].T + back[:3, 3] - self.body.center)
                            @ self.body.rotation) < self.body.size / 2 - 0.03
            self.assertTrue(name == "steel_cabinet" or not inside.all(axis=1).any(), msg=name)
        self.assertEqual(quality["checks"]["coincident_m2"], {})
        with open(self.at("scene", "scene.yaml"), encoding="utf-8") as text:
            self.assertEqual(yaml.safe_load(text)["actors"]["steel_cabinet"]["material"], "Metal")

    def test_bad_places_are_refused_in_one_line(self):
        for place, name, pattern in ((self.body.center + [9, 0, 0], "steel_cabinet", "outside of the room"),
                                     (self.body.center, "wall_1", "name of a plane"),
                                     (self.body.center * math.nan, "steel_cabinet", "pose")):
            status, out, said = self.objects(place, name)
            self.assertEqual(status, 2, msg=f"{out}{said}")
            errors = [line for line in said.splitlines() if line.startswith("error")]
            self.assertEqual(len(errors), 1, msg=said)
            self.assertRegex(errors[0], pattern)
            self.assertFalse(os.path.exists(self.at("scene")))


@unittest.skipIf(PROGRAM is None, "make_scene is not built in this workspace")
class ModelledRoom(InFolder):
    def test_named_parts_stay_as_they_are(self):
        """A room of named parts is taken as it was modelled."""
        write_obj(build_actors(), self.at("office.obj"))
        status, _, said = make_scene(self.at("office.obj"), "--output", self.at("scene"))
        self.assertEqual(status, 0, msg=said)
        with open(self.at("scene", "scene.yaml"), encoding="utf-8") as text:
            scene = yaml.safe_load(text)
        self.assertTrue(scene["meshes"][0]["file"].endswith("office.obj"))


if __name__ == "__main__":
    unittest.main()
