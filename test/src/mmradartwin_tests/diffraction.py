"""Uniform theory of diffraction for wedges (Kouyoumjian and Pathak 1974), in the convention exp(-jkL)."""
import math

import numpy as np
from scipy.special import fresnel as fresnel_integrals


def transition(x):
    """F(x) = 2j sqrt(x) exp(jx) integral from sqrt(x) to infinity of exp(-j t^2) dt."""
    x = np.asarray(x, float)
    s, c = fresnel_integrals(np.sqrt(2 * x / np.pi))
    exact = 2j * np.sqrt(x) * np.exp(1j * x) * math.sqrt(math.pi / 2) * ((0.5 - c) - 1j * (0.5 - s))
    large = np.maximum(x, 1.0)
    series = 1 + 1j / (2 * large) - 3 / (4 * large**2) - 15j / (8 * large**3) + 75 / (16 * large**4)
    return np.where(x > 30.0, series, exact)


def wedge(n, phi, phi_in, distance_parameter_m, wavenumber, gamma_0=-1.0, gamma_n=-1.0):
    """Diffraction coefficient D [m^0.5] of a wedge with exterior angle n pi for the field along the edge.

    phi, phi_in: observer's and source's angles from face 0. distance_parameter: s s'/(s + s') at normal incidence.
    gamma_0, gamma_n: reflection of the faces; -1 for a conductor (soft).
    """
    def term(sign, beta):
        """cot((pi + sign beta)/(2n)) F(k L a)."""
        whole = round((beta + sign * math.pi) / (2 * math.pi * n))
        a = 2 * math.cos((2 * math.pi * n * whole - beta) / 2)**2
        angle = (math.pi + sign * beta) / (2 * n)
        if abs(math.sin(angle)) < 1e-9:  # on a shadow boundary: the mean of both sides
            return 0.5 * (term(sign, beta + 1e-7) + term(sign, beta - 1e-7))
        return math.cos(angle) / math.sin(angle) * complex(transition(wavenumber * distance_parameter_m * a))

    minus, plus = phi - phi_in, phi + phi_in
    total = term(1, minus) + term(-1, minus) + gamma_n * term(1, plus) + gamma_0 * term(-1, plus)
    return -np.exp(-1j * math.pi / 4) / (2 * n * math.sqrt(2 * math.pi * wavenumber)) * total
