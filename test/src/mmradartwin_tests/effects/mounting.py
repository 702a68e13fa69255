"""Effects of where the radar truly stands. All are true minus reported."""
import math

import numpy as np

from mmradartwin_tests.effects.effect import Effect, effect
from mmradartwin_tests.geometry import rotation_z
from mmradartwin_tests.tracing import Pose


@effect
class RadarYawOffset(Effect):
    """Mount yaw, positive to the left."""
    name, main = "radar_yaw_offset", "yaw_deg"
    defaults = {"yaw_deg": 2.0}

    def pose(self, measurement, station):
        return Pose(station.true.position, station.true.rotation @ rotation_z(math.radians(self.p["yaw_deg"])))


@effect
class RadarPitchOffset(Effect):
    """Mount pitch about y, nose down positive."""
    name, main = "radar_pitch_offset", "pitch_deg"
    defaults = {"pitch_deg": 4.0}
    plain = {"pitch_deg": 8.0}

    def pose(self, measurement, station):
        c, s = math.cos(math.radians(self.p["pitch_deg"])), math.sin(math.radians(self.p["pitch_deg"]))
        return Pose(station.true.position, station.true.rotation @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]))


@effect
class RadarPositionOffset(Effect):
    """Mount offset in the radar frame."""
    name = "radar_position_offset"
    defaults = {"forward_m": 0.04, "left_m": -0.03}

    def scale(self, strength):
        for key in self.defaults:
            self.p[key] *= strength

    def pose(self, measurement, station):
        offset = station.true.rotation @ np.array([self.p["forward_m"], self.p["left_m"], 0.0])
        return Pose(station.true.position + offset, station.true.rotation)


@effect
class SceneRegistration(Effect):
    """The whole room shifted and turned about map's origin."""
    name = "scene_registration"
    defaults = {"x_m": 0.05, "y_m": -0.03, "yaw_deg": 0.4}

    def scale(self, strength):
        for key in self.defaults:
            self.p[key] *= strength

    def room(self, measurement, actors, materials):
        turn = rotation_z(math.radians(self.p["yaw_deg"]))
        return [a.moved(turn, np.array([self.p["x_m"], self.p["y_m"], 0.0])) for a in actors], materials


@effect
class SceneScale(Effect):
    """The scan was made too large or too small: the true room is 1 + scale times it, about map's origin."""
    name, main = "scene_scale", "scale"
    defaults = {"scale": -0.01}
    plain = {"scale": -0.02}

    def room(self, measurement, actors, materials):
        return [a.scaled(1 + self.p["scale"]) for a in actors], materials
