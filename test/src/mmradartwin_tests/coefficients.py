"""Closed forms of reflection and of finite apertures, in the textbooks' convention exp(-jkL).

They are conjugated once, where samples are made.
"""
import numpy as np
from scipy.special import fresnel as fresnel_integrals


def fresnel(material, cos_theta, frequency_hz):
    """Half-space reflection (TE, TM) of ITU-R P.2040 for incidence cos_theta (array); -1, +1 for a conductor."""
    cos_theta = np.asarray(cos_theta, float)
    if material.conductor:
        return -np.ones_like(cos_theta) + 0j, np.ones_like(cos_theta) + 0j
    eta = material.complex_permittivity(frequency_hz)
    root = np.sqrt(eta - (1 - cos_theta**2))
    te = (cos_theta - root) / (cos_theta + root)
    tm = (eta * cos_theta - root) / (eta * cos_theta + root)
    return te, tm


def roughness_loss(material, cos_theta, frequency_hz):
    """Factor of the coherent amplitude, exp(-2 (k sigma cos)^2) (Ament)."""
    return np.exp(-2 * (2 * np.pi * frequency_hz / 299792458.0 * material.roughness_rms_m * cos_theta)**2)


def fresnel_e(u):
    """E(u) = C(u) - j S(u)."""
    s, c = fresnel_integrals(u)
    return c - 1j * s


def aperture_axis(x1_m, x2_m, d1_m, d2_m, wavelength_m):
    """Share of the full reflection that the strip from x1 to x2 (across the ray, from the reflection point) forms.

    d1, d2: path lengths before and after the reflection. 1 for an infinite strip.
    """
    scale = np.sqrt(2 * (d1_m + d2_m) / (wavelength_m * d1_m * d2_m))
    return (fresnel_e(x2_m * scale) - fresnel_e(x1_m * scale)) / (1 - 1j)


def transverse_vertical(direction, up):
    """Unit vector of the vertical polarisation across `direction` (both [3])."""
    e = up - (up @ direction) * direction
    return e / np.linalg.norm(e)


def reflect_field(field, k_in, normal, material, frequency_hz):
    """Complex field vector [3] after reflection of a ray with direction k_in; returns (field, k_out, cos_theta)."""
    cosine = k_in @ normal
    k_out = k_in - 2 * cosine * normal
    across = np.cross(k_in, normal)
    size = np.linalg.norm(across)
    if size < 1e-9:  # normal incidence: TE and TM are the same, any axis across the ray serves
        helper = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
        across = np.cross(k_in, helper)
        size = np.linalg.norm(across)
    te_axis = across / size
    tm_in, tm_out = np.cross(te_axis, k_in), np.cross(te_axis, k_out)
    te, tm = np.array(fresnel(material, abs(cosine), frequency_hz)) * roughness_loss(material, cosine, frequency_hz)
    return te * (field @ te_axis) * te_axis + tm * (field @ tm_in) * tm_out, k_out, abs(cosine)
