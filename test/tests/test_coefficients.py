"""Reflection and aperture against tables and limits."""
import math
import unittest

import numpy as np

from mmradartwin_tests.coefficients import aperture_axis, fresnel, reflect_field
from mmradartwin_tests.office import MATERIALS, Material


class Fresnel(unittest.TestCase):
    def test_normal_incidence_of_itu_table(self):
        for tag, expected in (("Concrete", .3926), ("Wood", .1714), ("Glass", .431), ("TableTop", .2335)):
            te, tm = fresnel(MATERIALS[tag], 1.0, 77e9)
            self.assertAlmostEqual(abs(te), expected, delta=6e-4, msg=tag)
            self.assertAlmostEqual(abs(te + tm), 0.0, places=12)

    def test_brewster_null_and_grazing(self):
        glass = Material(4.0, 0.0)
        _, tm = fresnel(glass, math.cos(math.atan(2.0)), 77e9)
        self.assertLess(abs(tm), 1e-12)
        te, _ = fresnel(glass, 1e-6, 77e9)
        self.assertAlmostEqual(te.real, -1.0, places=5)

    def test_te_of_quarter_circle(self):
        # eps = 4 at 45 degrees: (c - sqrt(4 - 1/2)) / (c + sqrt(4 - 1/2))
        c = math.sqrt(0.5)
        te, _ = fresnel(Material(4.0), c, 77e9)
        self.assertAlmostEqual(te.real, (c - math.sqrt(3.5)) / (c + math.sqrt(3.5)), places=12)

    def test_field_of_a_conductor_keeps_size_and_boundary_condition(self):
        rng = np.random.default_rng(3)
        for _ in range(20):
            k = rng.standard_normal(3)
            k /= np.linalg.norm(k)
            n = rng.standard_normal(3)
            n /= np.linalg.norm(n)
            e = np.cross(k, rng.standard_normal(3))
            e = e / np.linalg.norm(e)
            out, k_out, _ = reflect_field(e.astype(complex), k, n, MATERIALS["Metal"], 77e9)
            self.assertAlmostEqual(np.linalg.norm(out), 1.0, places=12)
            self.assertAlmostEqual(abs(out @ k_out), 0.0, places=12)
            # The tangential field on a conductor vanishes.
            self.assertLess(np.linalg.norm(np.cross(e + out, n)), 1e-12)


class Aperture(unittest.TestCase):
    def test_infinite_and_half_strip(self):
        self.assertAlmostEqual(abs(aperture_axis(-1e6, 1e6, 2.0, 2.0, 0.0039) - 1), 0.0, places=5)
        self.assertAlmostEqual(abs(aperture_axis(0.0, 1e6, 2.0, 2.0, 0.0039) - 0.5), 0.0, places=5)

    def test_knife_edge_losses(self):
        # J(nu) of ITU-R P.526, exact: a strip from nu to infinity; nu = u.
        for nu, loss in ((0, 6.021), (0.5, 10.234), (1, 13.864), (2, 19.091), (2.4, 20.618), (5, 26.936), (-1, -1.001)):
            d1, d2, wavelength = 1.0, 3.0, 0.004
            x = nu / math.sqrt(2 * (d1 + d2) / (wavelength * d1 * d2))
            factor = aperture_axis(x, 1e6, d1, d2, wavelength)
            self.assertAlmostEqual(-20 * math.log10(abs(factor)), loss, delta=0.002)


if __name__ == "__main__":
    unittest.main()
