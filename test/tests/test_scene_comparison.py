"""The comparison of a made scene with its known room: a scene written of the room itself has no error, and errors that are
put in are found at their size."""
import dataclasses
import math
import os
import unittest

import numpy as np
import yaml

from mmradartwin_tests.geometry import rotation_z
from mmradartwin_tests.office import write_obj
from mmradartwin_tests.scans import known_room, persistence, scene_comparison
from mmradartwin_tests.scans.degraded_scan import Degradation, Scan, scan_frame
from in_folder import InFolder

CLASSES = {"table": "table", "chair": "chair", "cabinet": "cabinet", "wardrobe": "cabinet", "sofa": "sofa", "door": "door",
           "pillar": "pillar", "bin": "bin"}


def perfect(folder, room, asked, moved=None, said=None):
    """Writes what an exact make_scene would write of a scan with a frame, in a map turned by 30 degrees; `moved`
    {actor: [3] shift}, `said` {actor: class}. Returns the Scan."""
    scan = Scan(np.zeros((0, 3)), None, None, scan_frame(asked), 0.01)
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = rotation_z(math.radians(30)), [1.0, -2.0, 0.0]
    flat_file = turn @ np.linalg.inv(scan.T_scan_map)
    flat_file[:3, :3] /= asked.unit_m
    actors, planes, things = [], [], []
    for actor in room.actors():
        parts = [r for part in actor.parts for r in known_room.rectangles_of(part)]
        shift = (moved or {}).get(actor.name, np.zeros(3))
        actors.append(type(actor)(actor.name, actor.tag, parts).moved(turn[:3, :3], turn[:3, 3] + shift))
        if actor.shell:
            planes.append({"name": actor.name})
        else:
            klass = (said or {}).get(actor.name, CLASSES[scene_comparison.kind_of(actor.name)])
            things.append({"name": actor.name, "class": klass})
    write_obj(actors, os.path.join(folder, "room.obj"))
    quality = {"unit_m": asked.unit_m, "T_map_file": flat_file[:3].tolist(), "planes": planes, "things": things,
               "areas": {"wall_m2": 50.0, "wall_on_planes_m2": 48.0}}
    for name, said in (("scan.yaml", quality), ("quality.yaml", {"checks": {}})):
        with open(os.path.join(folder, name), "w", encoding="utf-8") as out:
            yaml.safe_dump(said, out)
    return scan


def with_points(scan, room):
    """The scan with points 5 cm apart on all faces of the room."""
    points = []
    for r in (r for actor in room.actors() for part in actor.parts for r in known_room.rectangles_of(part)):
        u, v = np.arange(0, r.s1, 0.05), np.arange(0, r.s2, 0.05)
        points.append((r.origin + u[:, None, None] * r.e1 + v[None, :, None] * r.e2).reshape(-1, 3))
    S = scan.T_scan_map
    return dataclasses.replace(scan, points=np.concatenate(points) @ S[:3, :3].T + S[:3, 3])


class SceneComparison(InFolder):
    asked = Degradation("mm", unit_m=1e-3, y_up=True, tilt_deg=5.0, yaw_deg=20.0, offset_m=(1.0, 2.0, 0.5))

    def test_a_wall_that_stands_elsewhere_holds_none_of_the_scan(self):
        room = known_room.l_shaped_room()
        scan = with_points(perfect(self.folder, room, self.asked, {room.wall_names[0]: np.array([0.3, 0.4, 0])}), room)
        areas = {actor.name: sum(r.s1 * r.s2 for r in actor.parts) for actor in room.shell()[2:]}
        held = 1 - areas[room.wall_names[0]] / sum(areas.values())
        self.assertAlmostEqual(scene_comparison.compare(self.folder, room, scan).wall_share, held, delta=0.03)

    def test_exact_scene_has_no_error(self):
        room = known_room.l_shaped_room()
        scan = with_points(perfect(self.folder, room, self.asked), room)
        found = scene_comparison.compare(self.folder, room, scan)
        self.assertLess(abs(found.floor_m), 1e-6)
        self.assertLess(found.tilt_deg, 1e-4)
        self.assertEqual([w[0] for w in found.walls], room.wall_names)
        self.assertLess(max(w[1] for w in found.walls), 1e-5)
        self.assertLess(max(w[2] for w in found.walls), 1e-3)
        self.assertEqual(found.wall_share, 1)
        self.assertTrue(all(right for _, _, right in found.furniture + found.flat), msg=f"{found}")
        self.assertEqual([n for n, _, _ in found.flat], ["door_1"])
        self.assertEqual(len(found.furniture), 10)
        self.assertEqual(found.extra, [])

    def test_errors_are_found_at_their_size(self):
        room = known_room.l_shaped_room()
        shift = 0.011 * (rotation_z(math.radians(30)) @ [0, 1, 0])
        scan = perfect(self.folder, room, self.asked, moved={"wall_north": shift, "wall_west": np.array([0, 0, 0.3]),
                                                             "cabinet_1": np.array([1.0, 0, 0]), "bin_1": np.zeros(3)},
                       said={"bin_1": "chair"})
        found = scene_comparison.compare(self.folder, room, scan)
        errors = {name: offset for name, offset, _ in found.walls}
        self.assertAlmostEqual(errors["wall_north"], 0.011, places=5)
        self.assertLess(errors["wall_west"], 1e-5)       # moved along itself
        rows = {name: (said, right) for name, said, right in found.furniture}
        self.assertEqual(rows["bin_1"], ("chair", False))
        self.assertEqual(rows["cabinet_1"], ("", False))
        self.assertEqual(found.extra, ["cabinet_1"])

    def test_absent_wall_is_no_small_error(self):
        room = known_room.l_shaped_room()
        scan = perfect(self.folder, room, self.asked, moved={"wall_east": np.array([0.5, 0.5, 0])})
        found = scene_comparison.compare(self.folder, room, scan)
        self.assertTrue(math.isnan({n: o for n, o, _ in found.walls}["wall_east"]))


class Pairs(InFolder):
    def test_pairs_are_free_and_a_centimetre_apart(self):
        room = known_room.office_room()
        T = np.eye(4)
        T[:3, :3] = rotation_z(0.5)
        pairs = persistence.draw_pairs(room, T, np.random.default_rng(1), 20)
        for (p, yaw_p), (q, yaw_q) in pairs:
            self.assertAlmostEqual(np.linalg.norm(p - q), 0.01, places=9)
            self.assertEqual(yaw_p, yaw_q)
            self.assertGreater(room.clearance(T[:3, :3].T @ p), 0.5)

    def test_counts_what_persists(self):
        os.mkdir(self.at("paths"))
        head = ("event,actors,length_m,azimuth_dep_deg,elevation_dep_deg,azimuth_arr_deg,elevation_arr_deg,amplitude_db\n")
        rows = {"a000": ["specular,wall_1,4.0,10,0,10,0,-60", "specular,wall_2,5.0,-20,0,-20,0,-70",
                         "specular,wall_3,6.0,0,0,0,0,-75", "specular,wall_4,6.0,40,0,40,0,-81"],
                "b000": ["specular,wall_1,4.01,10.2,0,10.2,0,-60.5", "specular,wall_2,5.1,-20,0,-20,0,-70",
                         "specular,wall_3,6.005,0,0,0,0,-79"]}
        for name, lines in rows.items():
            with open(self.at("paths", name + ".csv"), "w", encoding="ascii") as out:
                out.write(head + "\n".join(lines) + "\n")
        found = persistence.measure(self.folder, [None])
        self.assertEqual(found["paths"], 3)                   # the fourth is weaker than 20 dB below the strongest
        self.assertAlmostEqual(found["persist"], 2 / 3)       # the second is 10 cm longer
        self.assertAlmostEqual(found["within_1_db"], 0.5)


if __name__ == "__main__":
    unittest.main()
