"""Small rooms and radars with closed-form answers."""
import numpy as np

from mmradartwin_tests.geometry import Actor, Room, sheet
from mmradartwin_tests.office import Material
from mmradartwin_tests.radar import SPEED_OF_LIGHT, Radar
from mmradartwin_tests.tracing import Pose

METAL = {"Metal": Material(conductor=True)}


class AllRound(Pose):
    """A pose without limits of its field of view."""

    def sees(self, directions):
        return np.ones(len(np.atleast_2d(directions)), bool)


def far_radar():
    """The radar sampled faster, so that its range reaches 80 m."""
    return Radar(sample_rate_hz=40.0e6)


def radar_at(wavelength_m):
    """far_radar with another wavelength at its window's centre."""
    radar = far_radar()
    radar.carrier_hz = SPEED_OF_LIGHT / wavelength_m - radar.slope_hz_per_s * radar.center_s
    return radar


def plate(distance_m, width_m, height_m, materials=None, tag="Metal"):
    """A plate across the x axis, centred on it."""
    actor = Actor("plate", tag, [sheet((distance_m, -width_m / 2, -height_m / 2), (0, width_m, 0), (0, 0, height_m))])
    return Room([actor], materials or METAL)


def bare_room(length_m, width_m, height_m, materials=None, tag="Metal"):
    """Four walls, floor and ceiling."""
    x, y, z = length_m, width_m, height_m
    return Room([
        Actor("floor", tag, [sheet((0, 0, 0), (x, 0, 0), (0, y, 0))], shell=True),
        Actor("ceiling", tag, [sheet((0, 0, z), (0, y, 0), (x, 0, 0))], shell=True),
        Actor("south", tag, [sheet((0, 0, 0), (0, 0, z), (x, 0, 0))], shell=True),
        Actor("north", tag, [sheet((0, y, 0), (x, 0, 0), (0, 0, z))], shell=True),
        Actor("west", tag, [sheet((0, 0, 0), (0, y, 0), (0, 0, z))], shell=True),
        Actor("east", tag, [sheet((x, 0, 0), (0, 0, z), (0, y, 0))], shell=True)], materials or METAL)
