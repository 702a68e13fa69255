"""The generator of degraded scans: what it writes has the faults that were asked for, and no others."""
import dataclasses
import math
import os
import unittest

import numpy as np

from mmradartwin_tests.scans import degraded_scan, known_room, triangle_budget
from mmradartwin_tests.scans.degraded_scan import Degradation, make_scan
from mmradartwin_tests.scans.drawn_room import SHAPES, draw_room
from mmradartwin_tests.scans.ray_casting import CastRoom
from in_folder import InFolder


def in_map(scan):
    """[V, 3] points as they stand in map."""
    T = np.linalg.inv(scan.T_scan_map)
    return scan.points @ T[:3, :3].T + T[:3, 3]


def distance_to_surface(room, points):
    """[P] distance to the nearest rectangle of the room, m."""
    cast = CastRoom(room)
    best = np.full(len(points), np.inf)
    for i in range(len(cast.actor)):
        q = points - cast.origin[i]
        u, v = q @ cast.e1[i], q @ cast.e2[i]
        du = np.maximum(np.maximum(-u, u - cast.s1[i]), 0)
        dv = np.maximum(np.maximum(-v, v - cast.s2[i]), 0)
        best = np.minimum(best, np.sqrt(du**2 + dv**2 + (q @ cast.normal[i])**2))
    return best


class DegradedScans(unittest.TestCase):
    def test_drawn_rooms_hold_their_furniture_and_are_free_to_stand_in(self):
        for shape in SHAPES:
            room, again, other = draw_room(shape, 5), draw_room(shape, 5), draw_room(shape, 6)
            np.testing.assert_array_equal(room.outline, again.outline)
            self.assertFalse(room.outline.shape == other.outline.shape and np.allclose(room.outline, other.outline))
            self.assertGreaterEqual(len(room.furniture), 3, msg=shape)
            for actor in room.furniture:
                corners = np.array([r.origin + a * r.s1 * r.e1 + b * r.s2 * r.e2 for part in actor.parts
                                    for r in part.rectangles() for a in (0, 1) for b in (0, 1)])
                self.assertTrue(room.contains(corners, -1e-6).all(), msg=f"{shape}: {actor.name}")
                self.assertLessEqual(corners[:, 2].max(), room.height_m, msg=f"{shape}: {actor.name}")
                below = [slant.parts[0].distance(p) for slant in room.slants for p in corners]
                self.assertGreater(min(below, default=1), 0, msg=f"{shape}: {actor.name} is in the roof")
            for place in room.standpoints(np.random.default_rng(1), 3):
                self.assertGreater(room.clearance(place), 0.1, msg=shape)

    def test_a_roof_bounds_the_scan(self):
        room = draw_room("attic", 5)
        roof = room.slants[0].parts[0]
        for kind in ("cloud", "fused"):
            points = in_map(make_scan(room, Degradation("roof", kind=kind, size=60000, noise_m=0.0), 2))
            inside = np.abs((points - roof.center) @ roof.rotation) - roof.size / 2
            depth = -inside.max(axis=1)       # below the roof's surface, m
            self.assertLess(depth.max(), 0.06, msg=kind)
            self.assertGreater(np.mean(np.abs(depth) < 0.02), 0.05, msg=kind)

    def test_same_seed_same_scan(self):
        room = known_room.l_shaped_room()
        for kind in ("cloud", "frames", "fused"):
            asked = Degradation("small", kind=kind, size=20000, holes=2, colors=True)
            a, b, other = make_scan(room, asked, 3), make_scan(room, asked, 3), make_scan(room, asked, 4)
            np.testing.assert_array_equal(a.points, b.points)
            np.testing.assert_array_equal(a.colors, b.colors)
            self.assertFalse(a.points.shape == other.points.shape and np.allclose(a.points, other.points))

    def test_points_are_off_the_room_by_the_noise_alone(self):
        room = known_room.office_room()
        for kind, noise_m, slack in (("cloud", 0.005, 0.5), ("frames", 0.005, 0.5), ("fused", 0.005, 0.5)):
            scan = make_scan(room, Degradation("noise", kind=kind, size=100000, noise_m=noise_m), 1)
            points = in_map(scan)
            wall = points[(points[:, 0] < 0.2) & (points[:, 0] > -0.1) & (points[:, 2] > 2.3) & (points[:, 2] < 2.7) &
                          (points[:, 1] > 0.3) & (points[:, 1] < 5.7)]
            self.assertGreater(len(wall), 100, msg=kind)
            # Along the ray, so that across the wall it is less.
            self.assertLess(abs(wall[:, 0].std() / noise_m - 0.8), slack, msg=f"{kind}: {wall[:, 0].std()}")
            # The error of a fused mesh is alike over patches, of which this wall has few.
            self.assertLess(abs(wall[:, 0].mean()), 0.002 if kind == "fused" else 0.0005, msg=kind)
            step = scan.step_m if kind == "fused" else 0
            self.assertGreater(np.mean(distance_to_surface(room, points) < 4 * noise_m + step), 0.97, msg=kind)

    def test_frame_is_as_asked(self):
        room = known_room.l_shaped_room()
        plain = Degradation("plain", kind="cloud", size=30000, noise_m=0.0)
        turned = dataclasses.replace(plain, y_up=True, unit_m=1e-3, tilt_deg=5.0, yaw_deg=20.0, offset_m=(1.0, 2.0, 3.0))
        scan = make_scan(room, turned, 2)
        up = scan.T_scan_map[:3, 2] * 1e-3
        self.assertAlmostEqual(np.degrees(np.arccos(up[1])), 5.0, places=6)
        np.testing.assert_allclose(in_map(scan), make_scan(room, plain, 2).points, atol=1e-5)
        self.assertGreater(np.ptp(scan.points[:, 0]), 3000)

    def test_ghosts_lie_behind_the_glass(self):
        room = known_room.office_room()
        clean = make_scan(room, Degradation("clean", kind="cloud", size=100000), 5)
        ghosts = make_scan(room, Degradation("ghosts", kind="cloud", size=100000, ghosts=0.5), 5)
        outside = lambda s: int((~room.contains(in_map(s), -0.1)).sum())
        self.assertEqual(outside(clean), 0)
        self.assertGreater(outside(ghosts), 300)

    def test_holes_and_unseen_places_are_empty(self):
        room = known_room.l_shaped_room()
        asked = Degradation("fused", size=60000)
        whole, holed = make_scan(room, asked, 6), make_scan(room, dataclasses.replace(asked, holes=10), 6)
        self.assertLess(len(holed.points), 0.99 * len(whole.points))
        closed = make_scan(room, dataclasses.replace(asked, unseen=True), 6)
        self.assertGreater(len(closed.points), 1.01 * len(whole.points))
        # A mesh that closes what nobody saw has no open edge.
        edges = np.sort(np.concatenate([closed.faces[:, [0, 1]], closed.faces[:, [1, 2]], closed.faces[:, [2, 0]]]), axis=1)
        _, count = np.unique(edges, axis=0, return_counts=True)
        self.assertTrue((count % 2 == 0).all())

    def test_doubled_surfaces_lie_apart(self):
        room = known_room.office_room()
        asked = Degradation("frames", kind="frames", size=60000, noise_m=0.0005)
        apart = dataclasses.replace(asked, place_error_m=0.01)
        spread = lambda s: np.median(distance_to_surface(room, in_map(s)))
        self.assertLess(spread(make_scan(room, asked, 7)), 0.001)
        self.assertGreater(spread(make_scan(room, apart, 7)), 0.003)

    def test_rounding_eats_edges(self):
        room = known_room.office_room()
        sharp = make_scan(room, Degradation("sharp", size=60000, noise_m=0.0), 8)
        soft = make_scan(room, Degradation("soft", size=60000, noise_m=0.0, smooth_steps=1.6), 8)
        # The upper edge of the large wooden cupboard, 1.82 m high, away from walls.
        near = lambda s: [p for p in in_map(s) if abs(p[2] - 1.82) < 0.05 and 0.2 < p[0] < 0.8 and 1.0 < p[1] < 1.7]
        self.assertGreater(max(p[2] for p in near(sharp)), max(p[2] for p in near(soft)) - 1e-9)
        self.assertEqual(set(degraded_scan.DEGRADATIONS), {d.name for d in degraded_scan.DEGRADATIONS.values()})


class PathsOfTwoMeshes(InFolder):
    def write(self, name, pose, rows):
        """A path list of (length, azimuth, level, bounces, event, actors)."""
        os.makedirs(self.at(name, "paths"), exist_ok=True)
        with open(self.at(name, "paths", pose + ".csv"), "w", encoding="ascii") as out:
            out.write("length_m,azimuth_dep_deg,elevation_dep_deg,azimuth_arr_deg,elevation_arr_deg,amplitude_db,phase_rad,"
                      "bounces,event,actors,materials\n")
            for length, azimuth, level, bounces, event, actors in rows:
                out.write(f"{length},{azimuth},0,{azimuth},0,{level},0,{bounces},{event},{actors},Wood\n")

    def test_paths_are_known_by_range_direction_and_bounces_whatever_the_actors_are_called(self):
        self.write("true", "a000", [(4.0, 0, -80, 1, "specular", "wall_east"), (6.0, 20, -90, 1, "specular", "locker"),
                                    (8.0, 40, -95, 2, "corner", "wall_east;floor"),
                                    (9.0, 60, -101, 1, "specular", "far")])       # more than 20 dB below the strongest
        self.write("made", "a000", [(4.01, 1, -81, 1, "specular", "wall_1"),      # found, 1 dB off
                                    (6.05, 20, -90, 1, "specular", "cabinet_1"),  # 2.5 cm of range off
                                    (8.0, 40, -108, 2, "specular;specular", "a;b"),    # found, however weak: 13 dB off
                                    (9.0, 60, -100, 1, "specular", "b"),          # strong here alone, and the room has it
                                    (5.0, 0, -82, 1, "diffuse", "wall_1")])       # no specular path
        self.write("true", "a001", [(4.0, 0, -80, 1, "specular", "wall_east")])   # the scene refuses this pose
        agreed = triangle_budget.agree(self.at("true"), self.at("made"), 2)
        self.assertEqual((agreed["paths"], agreed["own"], agreed["refused"]), (3, 3, 1))
        self.assertAlmostEqual(agreed["found"], 2 / 3)
        self.assertAlmostEqual(agreed["true"], 2 / 3)
        self.assertAlmostEqual(agreed["level_db"], 7.0)
        self.assertAlmostEqual(agreed["level_90_db"], 1 + 0.9 * 12)
        os.remove(self.at("made", "paths", "a000.csv"))
        self.assertTrue(math.isnan(triangle_budget.agree(self.at("true"), self.at("made"), 2)["level_db"]))


if __name__ == "__main__":
    unittest.main()
