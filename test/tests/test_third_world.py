"""The third world's physics against closed forms, and what it writes."""
import dataclasses
import math
import os
import unittest

import numpy as np

from in_folder import InFolder
from mmradartwin_tests.third_world import hidden, rooms
from mmradartwin_tests.third_world.antenna import C, Front
from mmradartwin_tests.third_world.measured import FRAMES, ThirdWorld
from mmradartwin_tests.third_world.optics import STEP_M, World
from mmradartwin_tests.third_world.surfaces import Box, Face, Matter, Nature, reflection

FLAT = Nature(waviness_m=0, unevenness_db=0, roughness=0)
METAL = Matter(None)
BIN_M = C / (2 * 960e6)


def plain_front(**more):
    """Isotropic elements."""
    return Front(ripple_db=0, own_ripple_db=0, own_ripple_deg=0, **more)


def panel(distance_m, width_m, height_m, matter=METAL, nature=FLAT):
    """An upright rectangle across the x axis."""
    return Face("panel", matter, (distance_m, -width_m / 2, -height_m / 2), (0, 0, 1), (0, 1, 0), height_m, width_m,
                np.random.default_rng(1), nature)


def echoes(world, position=(0, 0, 0), heading_rad=0.0):
    """(one-way ranges [4096], Hann-windowed levels [M, 4096]) of a pose."""
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    profile = world.profile(np.array(position), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]))
    x = profile @ world.front.beat(np.arange(profile.shape[1]) * STEP_M)
    window = 0.5 * (1 - np.cos(2 * np.pi * np.arange(64) / 64))
    return np.arange(4096) / 64 * BIN_M, np.abs(np.fft.fft(x * window, 4096, axis=1)) / window.sum()


def db(amplitude):
    """Level of an amplitude."""
    return 20 * math.log10(amplitude)


class Optics(unittest.TestCase):
    def test_a_large_panel_echoes_as_its_image(self):
        front = plain_front()
        for distance in (2.0, 3.0, 5.3):
            ranges, levels = echoes(World([panel(distance, 4, 3)], [], [], front))
            for level in levels:
                self.assertAlmostEqual(db(level.max() / (front.wavelength_m / (8 * math.pi * distance))), 0, delta=0.3)
                self.assertAlmostEqual(ranges[level.argmax()], distance, delta=0.1 * BIN_M)

    def test_a_small_panel_far_away_follows_the_radar_equation(self):
        front, distance, side = plain_front(), 8.0, 0.08
        ranges, levels = echoes(World([panel(distance, side, side)], [], [], front))
        area = 4 * math.pi * side**4 / front.wavelength_m**2
        expected = front.wavelength_m * math.sqrt(area) / ((4 * math.pi)**1.5 * distance**2)
        # Beyond 2 D^2 / lambda = 3.3 m; the phase over the panel still takes 0.1 dB off.
        self.assertAlmostEqual(db(levels[0].max() / expected), 0, delta=0.3)
        self.assertAlmostEqual(ranges[levels[0].argmax()], distance, delta=0.1 * BIN_M)

    def test_a_dielectric_reflects_by_its_coefficient(self):
        concrete = Matter(5.24 - 0.32j)
        ratio = [echoes(World([panel(3, 3, 3, m)], [], [], plain_front()))[1][0].max() for m in (concrete, METAL)]
        self.assertAlmostEqual(db(ratio[0] / ratio[1]), db(0.3926), delta=0.05)
        self.assertAlmostEqual(abs(reflection(Matter(4.0), 0.5)), (math.sqrt(3.25) - 0.5) / (math.sqrt(3.25) + 0.5),
                               places=9)

    def test_roughness_takes_off_the_glint(self):
        front, sigma, side = plain_front(), 2e-4, 0.25      # about the first Fresnel zone
        nature, matter = dataclasses.replace(FLAT, roughness=1.0), Matter(None, roughness_m=sigma)
        at_6_m = lambda face: World([face], [], [], front).profile(np.zeros(3), np.eye(3))[0].sum()
        rough = [at_6_m(Face("panel", matter, (6, -side / 2, -side / 2), (0, 0, 1), (0, 1, 0), side, side,
                             np.random.default_rng(seed), nature)) for seed in range(8)]
        power = math.exp(-(2 * 2 * math.pi / front.wavelength_m * sigma)**2)
        self.assertAlmostEqual(db(abs(np.mean(rough) / at_6_m(panel(6, side, side)))), 10 * math.log10(power), delta=0.3)

    def test_walls_of_a_metal_room_echo_as_their_images(self):
        x, y, z = 6.0, 5.0, 2.8
        up, rng = (0, 0, 1), np.random.default_rng(2)
        walls = [((0, 0, 0), up, (1, 0, 0), z, x), ((0, y, 0), (1, 0, 0), up, x, z),
                 ((0, 0, 0), (0, 1, 0), up, y, z), ((x, 0, 0), up, (0, 1, 0), z, y)]
        front = plain_front()
        ranges, levels = echoes(World([Face("wall", METAL, *w, rng, FLAT) for w in walls], [], [], front),
                                (2.3, 1.9, 1.2), 0.4)
        # Images (0, 1), (1, 0), both corners and, of the third order, (0, 3) and (3, 0).
        for distance in (3.1, 3.7, math.hypot(3.7, 1.9), math.hypot(3.7, 3.1), 8.1, 9.7):
            near = np.abs(ranges - distance) < 0.5 * BIN_M
            level = levels[0, near].max()
            self.assertAlmostEqual(db(level / (front.wavelength_m / (8 * math.pi * distance))), 0, delta=0.5,
                                   msg=f"{distance} m")
            self.assertAlmostEqual(ranges[near][levels[0, near].argmax()], distance, delta=0.1 * BIN_M)

    def test_a_box_casts_a_shadow(self):
        front, wall = plain_front(), panel(4, 3, 2.5)
        box = Box(np.array([2.0, 0.0, 0.0]), np.array([0.2, 1.2, 2.5]), 0.0)
        ranges, levels = echoes(World([wall], [box], [], front))
        free = echoes(World([wall], [], [], front))[1]
        at = np.argmin(np.abs(ranges - 4))
        self.assertLess(db(levels[0, at] / free[0, at]), -20)

    def test_angles_of_channels(self):
        # A panel turned to face the radar from 30 degrees to the left: phases fall by pi sin(30) from channel to channel.
        front, angle = plain_front(), math.radians(30)
        normal = np.array([-math.cos(angle), -math.sin(angle), 0])
        along = np.cross((0, 0, 1), normal)
        face = Face("panel", METAL, -5 * normal - 0.2 * along + np.array([0, 0, -0.2]), along, (0, 0, 1), 0.4, 0.4,
                    np.random.default_rng(1), FLAT)
        np.testing.assert_allclose(face.normal, normal, atol=1e-9)
        profile = World([face], [], [], front).profile(np.zeros(3), np.eye(3))
        turns = np.angle(profile.sum(axis=1)[1:] / profile.sum(axis=1)[:-1])
        expected = -2 * math.pi * 0.0019467 / front.wavelength_m * math.sin(angle)
        np.testing.assert_allclose(turns, expected, atol=0.03)


class Sessions(InFolder):
    def test_every_kind_of_room_and_every_cause_is_drawn(self):
        for number, kind in enumerate(rooms.KINDS):
            plan = rooms.draw_plan(np.random.default_rng(number), kind)
            self.assertGreaterEqual(len(plan.pieces), 4)
            for i, one in enumerate(plan.pieces):
                for other in plan.pieces[i + 1:]:
                    self.assertFalse(rooms.collide(one.box, other.box, 0.0), msg=f"{one.name}, {other.name}")
        plan = rooms.draw_plan(np.random.default_rng(1), "store")
        spots = np.array([[2.7, 2.2, 1.1]])
        for cause, draw in hidden.CAUSES.items():
            self.assertTrue(draw(np.random.default_rng(5), plan, spots), msg=cause)

    def test_a_session_is_the_same_each_time_and_has_faults(self):
        folders = [self.at(name) for name in ("one", "same", "ideal")]
        for folder, without in zip(folders, ((), (), ("images", "compression", "things"))):
            ThirdWorld(7, None, "small_office", without, poses=2).write(folder)
        captures = []
        for folder in folders:
            with open(os.path.join(folder, "captures", "001.bin"), "rb") as file:
                captures.append(file.read())
            self.assertEqual(len(captures[-1]), FRAMES * 2 * 64 * 4 * 2 * 2)
        self.assertEqual(captures[0], captures[1])
        self.assertNotEqual(captures[0], captures[2])

    def test_properties_have_names(self):
        with self.assertRaisesRegex(ValueError, "no property dust"):
            ThirdWorld(7, None, "small_office", ("dust",))


if __name__ == "__main__":
    unittest.main()
