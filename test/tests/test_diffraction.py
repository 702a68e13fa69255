"""UTD against Sommerfeld's half plane and tables."""
import cmath
import math
import unittest

from mmradartwin_tests.diffraction import transition, wedge


class Transition(unittest.TestCase):
    def test_the_transition_function_is_that_of_the_published_table(self):
        for x, size, angle in ((.01, .1637, 40.632), (.1, .4364, 32.494), (.3, .6335, 25.524), (1, .8422, 16.005),
                               (3, .9565, 7.967), (10, .9942, 2.788)):
            value = complex(transition(x))
            self.assertAlmostEqual(abs(value), size, delta=1e-4)
            self.assertAlmostEqual(math.degrees(cmath.phase(value)), angle, delta=2e-3)

    def test_the_series_goes_over_into_the_integral_without_a_step(self):
        self.assertAlmostEqual(abs(complex(transition(29.999)) - complex(transition(30.001))), 0, delta=1e-5)


class HalfPlane(unittest.TestCase):
    """Plane wave from 60 degrees, k rho = 20, conductor, field along the edge."""

    def field(self, phi_deg):
        phi, phi_in, rho, k = math.radians(phi_deg), math.radians(60), 20.0, 1.0
        total = wedge(2.0, phi, phi_in, rho, k) * cmath.exp(-1j * k * rho) / math.sqrt(rho)
        if phi < math.pi + phi_in:
            total += cmath.exp(1j * k * rho * math.cos(phi - phi_in))
        if phi < math.pi - phi_in:
            total -= cmath.exp(1j * k * rho * math.cos(phi + phi_in))
        return total

    def test_exact_values(self):
        for phi, size in ((30, 1.399526), (90, 2.114831), (180, 1.059370), (239, .488427), (241, .441478),
                          (270, .117994), (330, .016837)):
            self.assertAlmostEqual(abs(self.field(phi)), size, delta=2e-6, msg=str(phi))

    def test_continuity_at_both_shadow_boundaries(self):
        for boundary in (120, 240):
            self.assertLess(abs(self.field(boundary - 0.001) - self.field(boundary + 0.001)), 1e-3)


class BoxEdge(unittest.TestCase):
    def test_monostatic_level_at_two_metres(self):
        # Equivalent radar cross-section of a long conducting 90 degree edge, dBsm; A = |D|/sqrt(2 R^3) against
        # sigma = 4 pi R^4 |A|^2.
        k, r = 1613.80, 2.0
        for phi_deg, expected in ((100, -18.2), (135, -25.3), (60, -35.6)):
            d = wedge(1.5, math.radians(phi_deg), math.radians(phi_deg), r / 2, k)
            sigma = 4 * math.pi * r**4 * abs(d)**2 / (2 * r**3)
            self.assertAlmostEqual(10 * math.log10(sigma), expected, delta=0.1)


if __name__ == "__main__":
    unittest.main()
