"""Images, corners, plates and scatter against closed forms."""
import math
import unittest

import numpy as np
from bare_rooms import METAL, AllRound, bare_room, far_radar, plate, radar_at

from mmradartwin_tests.coefficients import aperture_axis, fresnel
from mmradartwin_tests.geometry import Actor, Room, box, rotation_z, sheet
from mmradartwin_tests.office import MATERIALS, Material, build_room
from mmradartwin_tests.radar import Radar
from mmradartwin_tests.tracing import Pose, Tracer

LAMBDA_77 = 3.893409e-3
LEVEL = np.eye(3)


def db(amplitude):
    return 20 * math.log10(abs(amplitude))


class Plates(unittest.TestCase):
    def test_near_field_of_a_ten_centimetre_plate(self):
        radar = radar_at(LAMBDA_77)
        for distance, expected in ((1, 5.61), (2, 15.96), (3, 17.77), (5, 18.68), (10, 19.06), (50, 19.18)):
            paths = Tracer(plate(distance, 0.1, 0.1), radar).specular(Pose([0, 0, 0], LEVEL))
            self.assertEqual(len(paths), 1)
            sigma = abs(paths[0].coefficient)**2 * (4 * math.pi)**3 * distance**4 / LAMBDA_77**2
            self.assertAlmostEqual(10 * math.log10(sigma), expected, delta=0.1)

    def test_one_metre_plate_close_to_its_image(self):
        paths = Tracer(plate(5, 1.0, 1.0), radar_at(LAMBDA_77)).specular(Pose([0, 0, 0], LEVEL))
        sigma = abs(paths[0].coefficient)**2 * (4 * math.pi)**3 * 5**4 / LAMBDA_77**2
        self.assertAlmostEqual(10 * math.log10(sigma), 17.85, delta=0.1)

    def test_wall_is_its_image(self):
        radar = Radar()
        for tag, smooth in (("Concrete", math.sqrt(0.75)), ("Glass", 1.0)):
            path, = Tracer(plate(3.0, 400.0, 400.0, MATERIALS, tag), radar).specular(Pose([0, 0, 0], LEVEL))
            te, _ = fresnel(MATERIALS[tag], 1.0, radar.center_hz)
            # The field must not depend on conjugation yet: exp(-jkL), textbook sign.
            self.assertAlmostEqual(abs(path.coefficient / (te * smooth * radar.wavelength_m / (4 * math.pi * 6)) - 1),
                                   0, delta=0.02)
            self.assertAlmostEqual(path.length_m, 6.0, places=12)
            y = radar.tx[:, None, 1] - radar.rx[None, :, 1]
            np.testing.assert_allclose(path.lengths_m, np.hypot(6.0, y).ravel(), atol=1e-12)

    def test_beside_a_plate(self):
        # The radar's foot lies 6 cm beside the edge of a metre-wide plate.
        radar = Radar()
        path, = Tracer(plate(2.0, 1.0, 1.0), radar).specular(Pose([0, 0.56, 0], LEVEL))
        u = lambda x: 2 * x / math.sqrt(radar.wavelength_m * 2.0)
        wide = aperture_axis(-1.06, -0.06, 2.0, 2.0, radar.wavelength_m)
        high = aperture_axis(-0.5, 0.5, 2.0, 2.0, radar.wavelength_m)
        self.assertAlmostEqual(abs(wide), abs(1 / (math.sqrt(2) * math.pi * u(0.06))), delta=0.05)   # knife edge's tail
        self.assertAlmostEqual(abs(path.coefficient), radar.wavelength_m / (16 * math.pi) * abs(wide * high),
                               delta=1e-12)
        self.assertAlmostEqual(path.length_m, 2 * math.hypot(2.0, 0.07), places=9)
        self.assertAlmostEqual(math.atan2(path.departure[1], path.departure[0]), math.atan2(-0.07, 2.0), places=9)

    def test_far_beside_is_dropped(self):
        self.assertEqual(Tracer(plate(2.0, 1.0, 1.0), Radar()).specular(Pose([0, 1.6, 0], LEVEL)), [])

    def test_table_tops_and_floors_do_not_reflect(self):
        room = Room([Actor("top", "Metal", [sheet((1, -1, 0), (2, 0, 0), (0, 2, 0))])], METAL)
        self.assertEqual(Tracer(room, Radar()).specular(AllRound([2, 0, 1], LEVEL)), [])


class BareRoom(unittest.TestCase):
    POSITION = (1.0137, 3.0291, 15.1173)

    def setUp(self):
        self.radar = far_radar()
        tracer = Tracer(bare_room(8, 6, 30), self.radar)
        self.paths = tracer.specular(AllRound(self.POSITION, LEVEL))

    def images(self, order):
        """Half distances to the images over vertical walls, with multiplicity."""
        x, y, _ = self.POSITION
        at = lambda m, length, c: m * length + c if m % 2 == 0 else (m + 1) * length - c
        found = []
        for m in range(-order, order + 1):
            for n in (order - abs(m), abs(m) - order):
                found.append(math.hypot(at(m, 8, x) - x, at(n, 6, y) - y) / 2)
                if n == 0:
                    break
        return sorted(found)

    def test_counts_and_ranges_of_all_orders(self):
        for order in (1, 2, 3):
            ranges = sorted(p.length_m / 2 for p in self.paths if len(p.facets) == order)
            np.testing.assert_allclose(ranges, self.images(order), atol=1e-9, err_msg=f"order {order}")

    def test_reference_list_of_order_two(self):
        ranges = sorted(p.length_m / 2 for p in self.paths if len(p.facets) == 2)
        np.testing.assert_allclose(ranges, [3.139082, 3.194219, 6, 6, 7.591748, 7.614712, 8, 8], atol=1e-6)

    def test_amplitudes_are_those_of_images(self):
        # Where the edges are many Fresnel zones away, conductors give lambda/(4 pi L) within the aperture's ripple.
        corners = np.array([[0, 0], [8, 0], [0, 6], [8, 6]])
        clear = [p for p in self.paths if p.event == "specular" and
                 np.linalg.norm(p.vertices[:, None, :2] - corners, axis=2).min() > 1.0]
        self.assertGreater(len(clear), 12)
        for p in clear:
            image = self.radar.wavelength_m / (4 * math.pi * p.length_m)
            self.assertAlmostEqual(db(p.coefficient) - db(image), 0.0, delta=0.5, msg=str(p.facets))

    def test_no_path_counts_twice(self):
        keys = {(round(p.length_m, 9), tuple(np.round(p.departure, 9))) for p in self.paths}
        self.assertEqual(len(keys), len(self.paths))

    def test_reverse_paths_both_count(self):
        lookup = {p.facets: p for p in self.paths if p.event == "specular"}
        pairs = [f for f in lookup if f[::-1] in lookup and f != f[::-1]]
        self.assertGreaterEqual(len(pairs), 4)
        for f in pairs:
            self.assertAlmostEqual(abs(lookup[f].coefficient), abs(lookup[f[::-1]].coefficient), delta=1e-12)


class Corners(unittest.TestCase):
    def room(self, tag="Concrete"):
        faces = [Actor("a", tag, [sheet((0, 0, -3), (9, 0, 0), (0, 0, 6))]),
                 Actor("b", tag, [sheet((0, 0, -3), (0, 9, 0), (0, 0, 6))])]
        return Room(faces, MATERIALS)

    def test_squared_reflection_at_the_apex(self):
        radar = Radar()
        position = np.array([3.0, 2.0, 0.1])
        tracer = Tracer(self.room(), radar)
        corner, = [p for p in tracer.specular(AllRound(position, LEVEL)) if p.event == "corner"]
        r = math.hypot(3, 2)
        self.assertAlmostEqual(corner.length_m, 2 * r, places=12)
        te_a, _ = fresnel(MATERIALS["Concrete"], 2 / r, radar.center_hz)
        te_b, _ = fresnel(MATERIALS["Concrete"], 3 / r, radar.center_hz)
        expected = te_a * te_b * 0.75 * radar.wavelength_m / (8 * math.pi * r)
        self.assertAlmostEqual(db(corner.coefficient) - db(expected), 0.0, delta=0.3)
        # Image of the transmitter through the edge.
        tx, rx = radar.tx + position, radar.rx + position
        image = tx * [-1, -1, 1]
        np.testing.assert_allclose(corner.lengths_m, np.linalg.norm(image[:, None] - rx, axis=2).ravel(), atol=1e-12)

    def test_no_return_from_the_convex_side_of_a_box(self):
        room = Room([Actor("cabinet", "Metal", [box((0, 0, 0), (1, 1, 2))])], METAL)
        tracer = Tracer(room, Radar())
        self.assertEqual(tracer.corners, [])
        for p in tracer.specular(AllRound([1.5, 1.4, 0], LEVEL)):
            self.assertEqual(len(p.facets), 1)

    def test_seen_from_behind_there_is_no_corner(self):
        tracer = Tracer(self.room(), Radar())
        self.assertEqual([p for p in tracer.specular(AllRound([-1.0, 2.0, 0], LEVEL)) if p.event == "corner"], [])

    def test_office_has_its_corners(self):
        room = build_room()
        names = sorted(tuple(sorted((room.actors[room.actor[c.a]].name, room.actors[room.actor[c.b]].name)))
                       for c in Tracer(room, Radar(), scatter_density_per_m2=1.0).corners)
        self.assertEqual(names, [("partition", "partition"), ("wall_east", "wall_north"), ("wall_east", "wall_south"),
                                 ("wall_north", "wall_west"), ("wall_south", "wall_west")])


class Views(unittest.TestCase):
    def test_occlusion_by_a_box(self):
        room = Room([Actor("box", "Metal", [box((2, 0, 0), (0.5, 0.5, 0.5), 30)])], METAL)
        self.assertFalse(room.visible([0, 0, 0], [4, 0, 0])[0])
        self.assertTrue(room.visible([0, 0, 0], [4, 1.2, 0])[0])
        self.assertTrue(room.visible([0, 0, 0], [1.6, 0, 0])[0])
        # Its own surface does not hide a point of the near face, and hides one of the far face.
        near = np.array([2, 0, 0]) - 0.25 * rotation_z(math.radians(30))[:, 0]
        self.assertTrue(room.visible([0, 0, 0], near)[0])
        self.assertFalse(room.visible([0, 0, 0], 2 * np.array([2, 0, 0]) - near)[0])

    def test_plate_behind_a_plate_is_hidden(self):
        room = Room([Actor("near", "Metal", [sheet((2, -1, -1), (0, 2, 0), (0, 0, 2))]),
                     Actor("far", "Metal", [sheet((3, -1, -1), (0, 2, 0), (0, 0, 2))])], METAL)
        paths = Tracer(room, Radar()).specular(Pose([0, 0, 0], LEVEL))
        self.assertEqual([p.actors for p in paths], [(0,)])

    def test_field_of_view(self):
        tracer = Tracer(plate(3.0, 4.0, 4.0), Radar())
        for yaw, count in ((0, 1), (89, 1), (-89, 1), (91, 0), (180, 0)):
            self.assertEqual(len(tracer.specular(Pose([0, 0, 0], rotation_z(math.radians(yaw))))), count)
        pitch = lambda deg: np.array([[math.cos(math.radians(deg)), 0, math.sin(math.radians(deg))], [0, 1, 0],
                                      [-math.sin(math.radians(deg)), 0, math.cos(math.radians(deg))]])
        self.assertEqual(len(tracer.specular(Pose([0, 0, 0], pitch(19.9)))), 1)
        self.assertEqual(len(tracer.specular(Pose([0, 0, 0], pitch(20.1)))), 0)


class RigidMotion(unittest.TestCase):
    def test_radar_turned_sees_the_same_lengths(self):
        room, radar = build_room(), Radar()
        tracer = Tracer(room, radar, scatter_density_per_m2=1.0)
        a = tracer.specular(Pose([3.2, 2.2, 1.1], LEVEL))
        b = tracer.specular(Pose([3.2, 2.2, 1.1], rotation_z(math.radians(20))))
        common = {p.facets: p for p in a}
        shared = [p for p in b if p.facets in common]
        self.assertGreater(len(shared), 4)
        for p in shared:
            self.assertAlmostEqual(p.length_m, common[p.facets].length_m, places=9)
            self.assertAlmostEqual(abs(p.coefficient), abs(common[p.facets].coefficient), places=12)


class Diffuse(unittest.TestCase):
    def test_power_of_a_lambert_wall(self):
        # Integral of (lambda S cos / (4 pi r^2))^2 / pi over an infinite wall at h: lambda^2 S^2 / (32 pi^2 h^2).
        materials = {"Rough": Material(conductor=True, scattering=0.5)}
        radar = far_radar()
        tracer = Tracer(plate(1.5, 24.0, 24.0, materials, "Rough"), radar, scatter_density_per_m2=150.0)
        scatter = tracer.diffuse(AllRound([0, 0, 0], LEVEL))
        expected = (radar.wavelength_m * 0.5)**2 / (32 * math.pi**2 * 1.5**2)
        self.assertAlmostEqual(np.sum(scatter.amplitude**2) / expected, 1.0, delta=0.02)

    def test_smooth_surfaces_do_not_scatter(self):
        self.assertEqual(len(Tracer(plate(2.0, 2.0, 2.0), Radar()).diffuse(Pose([0, 0, 0], LEVEL)).phase), 0)

    def test_phase_belongs_to_the_point(self):
        room = plate(2.0, 2.0, 2.0, {"Rough": Material(5.24, 1.38, scattering=0.5)}, "Rough")
        tracer = Tracer(room, Radar())
        a, b = tracer.diffuse(Pose([0, 0, 0], LEVEL)), tracer.diffuse(Pose([0.3, 0.1, 0], LEVEL))
        lookup = {tuple(p): phase for p, phase in zip(a.points, a.phase)}
        shared = [(lookup[tuple(p)], phase) for p, phase in zip(b.points, b.phase) if tuple(p) in lookup]
        self.assertGreater(len(shared), 100)
        self.assertTrue(all(x == y for x, y in shared))

    def test_mean_level_does_not_depend_on_density(self):
        material = {"Rough": Material(5.24, 1.38, scattering=0.4)}
        room = plate(2.0, 3.0, 2.0, material, "Rough")
        power = [np.sum(Tracer(room, Radar(), d).diffuse(Pose([0, 0, 0], LEVEL)).amplitude**2) for d in (300.0, 3000.0)]
        self.assertAlmostEqual(power[0] / power[1], 1.0, delta=0.02)


if __name__ == "__main__":
    unittest.main()
