#!/usr/bin/env python3
"""Points that attribution_node detects in maps, and how those of radar and twin agree."""
import json
import os
import subprocess
import sys
import unittest

import numpy

from in_folder import InFolder
from mmradartwin_tests.installed_programs import find_program
from test_launch_files import end, free_port, start_master
from wait_for import PATIENCE_S

# In a process of its own: rospy knows one master for as long as it lives. Takes a line of JSON with both maps, and
# prints the points of the measured one, which is sent alone at first, then those of the simulated one and the agreement.
EXCHANGE = """
import hashlib, io, json, math, sys, threading, rospy
from geometry_msgs.msg import Point
from mmradartwin_msgs.msg import DetectionAgreement, RadarConfig, RangeAngleMap
from sensor_msgs.msg import PointCloud2
from sensor_msgs.point_cloud2 import read_points
rospy.init_node("exchange")
maps = json.loads(sys.stdin.readline())
news, seen = threading.Condition(), {}
def keep(key, message):
    with news:
        seen[key] = message
        news.notify_all()
def wanted(*keys):
    with news:
        if not news.wait_for(lambda: set(keys) <= set(seen), 60):
            raise SystemExit("only %s came" % sorted(seen))
        return [seen[key] for key in keys]
def wait_for(condition):
    while not condition():
        rospy.rostime.wallsleep(0.01)
pitch = 299792458 / 77e9 / 2
radar = RadarConfig(device="awr2243", carrier_hz=77e9, slope_hz_per_s=75e12, samples_per_chirp=64, sample_rate_hz=5e6,
                    adc_start_s=6e-6, loops_per_frame=1, frame_period_s=0.05, layout="4lane", iq_order="iq",
                    tx_position_m=[Point(0, 4 * k * pitch, 0) for k in range(2)],
                    rx_position_m=[Point(0, k * pitch, 0) for k in range(4)])
radar.idle_s = radar.ramp_end_s = radar.rx_gain_db = radar.tx_backoff_db = math.nan
buffer = io.BytesIO()
radar.serialize(buffer)
radar_hash = int.from_bytes(hashlib.sha256(buffer.getvalue()).digest()[:8], "little")
def message(source):
    map = RangeAngleMap(radar_hash=radar_hash, source=source, frames=1, **maps["axes"],
                        power_db=maps["maps"][source])
    map.header.stamp, map.header.frame_id, map.T_map_radar.orientation.w = rospy.Time(100), "radar_link", 1
    return map
subscribers = [rospy.Subscriber("/radar/points", PointCloud2, lambda m: keep("radar", m)),
               rospy.Subscriber("/twin/points", PointCloud2, lambda m: keep("twin", m)),
               rospy.Subscriber("/attribution/detection_agreement", DetectionAgreement, lambda m: keep("both", m))]
publishers = [rospy.Publisher(name, type, queue_size=10) for name, type in (
    ("/radar/config", RadarConfig), ("/radar/range_angle", RangeAngleMap), ("/twin/range_angle", RangeAngleMap))]
wait_for(lambda: all(c.get_num_connections() == 1 for c in subscribers + publishers))
publishers[0].publish(radar)
measured = message(0)
# Nothing says when the radar was taken in, and a map of before goes without points.
while not seen:
    publishers[1].publish(measured)
    rospy.rostime.wallsleep(0.1)
alone = wanted("radar")[0]
publishers[2].publish(message(1))
_, twin, both = wanted("radar", "twin", "both")
def told(cloud):
    return {"frame": cloud.header.frame_id, "stamp": cloud.header.stamp.to_sec(),
            "fields": [f.name for f in cloud.fields], "points": list(read_points(cloud))}
print(json.dumps([told(alone), told(twin), {name: getattr(both, name) for name in both.__slots__[1:]}]))
"""

FIELDS = ["x", "y", "z", "snr_db", "range_m", "azimuth_deg"]
FLOOR_DB = -90


class Maps:
    """Axes of the paper's radar, and maps on them."""
    range_m = numpy.arange(64) * 299792458 / (2 * 75e12 * 64 / 5e6)
    # Elements are half a wavelength apart at 77 GHz, and the window's centre lies at 77.93 GHz.
    azimuth_rad = numpy.arcsin((numpy.arange(64) - 32) / 32 * 77 / (77 + 75 * (6 + 6.4) * 1e-3))

    @staticmethod
    def with_targets(power_db, targets):
        r, a = numpy.mgrid[:64, :64]
        for range_bin, angle_bin, level_db in targets:
            hump = level_db - 6 * (r - range_bin)**2 - 0.4 * (a - angle_bin)**2
            hump[(abs(r - range_bin) > 2) | (abs(a - angle_bin) > 7)] = -numpy.inf
            power_db = numpy.maximum(power_db, hump)
        return power_db

    @classmethod
    def places_m(cls, targets):
        return numpy.array([[cls.range_m[r] * numpy.cos(cls.azimuth_rad[a]),
                             cls.range_m[r] * numpy.sin(cls.azimuth_rad[a])] for r, a, _ in targets])


class Points(InFolder):
    def setUp(self):
        super().setUp()
        self.environment = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{free_port()}", ROS_IP="127.0.0.1",
                                ROS_HOME=self.folder)
        self.addCleanup(end, start_master(self.environment))

    def exchanged(self, measured_db, simulated_db, *parameters):
        """What comes of both maps: points of the measured and of the simulated map, and how they agree."""
        node = subprocess.Popen([find_program("mmradartwin_attribution", "attribution_node"), *parameters],
                                env=self.environment)
        self.addCleanup(end, node)
        maps = {"axes": {"range_m": Maps.range_m.tolist(), "azimuth_rad": Maps.azimuth_rad.tolist()},
                "maps": [measured_db.ravel().tolist(), simulated_db.ravel().tolist()]}
        done = subprocess.run([sys.executable, "-c", EXCHANGE], env=self.environment, input=json.dumps(maps) + "\n",
                              text=True, capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(done.returncode, 0, done.stderr[-3000:])
        end(node)
        return json.loads(done.stdout)

    def assert_points(self, cloud, targets):
        self.assertEqual((cloud["frame"], cloud["stamp"], cloud["fields"]), ("radar_link", 100, FIELDS))
        points = numpy.array(cloud["points"])
        expected = numpy.column_stack([
            Maps.places_m(targets), numpy.zeros(len(targets)), [level_db - FLOOR_DB for _, _, level_db in targets],
            [Maps.range_m[r] for r, _, _ in targets], [numpy.degrees(Maps.azimuth_rad[a]) for _, a, _ in targets]])
        self.assertEqual(points.shape, expected.shape, points)
        numpy.testing.assert_allclose(numpy.delete(points, 3, 1), numpy.delete(expected, 3, 1), atol=1e-4)
        numpy.testing.assert_allclose(points[:, 3], expected[:, 3], atol=3)  # of an estimated noise

    def test_targets_of_both_maps_become_points_that_are_compared(self):
        """The twin's level is another, and a target in the near range is not compared."""
        noise_db = FLOOR_DB + 10 * numpy.log10(numpy.random.default_rng(4).exponential(size=(64, 64)))
        measured = [(1, 32, -58), (20, 32, -50), (40, 40, -60)]
        # One a bin farther, one that is not measured, one that no receiver would see in its noise.
        simulated = [(21, 32, -50), (50, 10, -55)]
        unseen = (36, 55, -90)
        for kind in ("ca", "os"):
            with self.subTest(kind):
                radar, twin, both = self.exchanged(Maps.with_targets(noise_db, measured),
                                                   Maps.with_targets(numpy.full((64, 64), -200.0),
                                                                     [*simulated, unseen]) - 40,
                                                   "_cfar_kind:=" + kind, "_cfar_false_alarm_rate:=1e-7")
                self.assert_points(radar, measured)
                self.assert_points(twin, simulated)
                self.assertEqual([both[name] for name in ("measured", "simulated", "matched", "radius_m", "precision",
                                                          "recall")], [2, 2, 1, 0.5, 0.5, 0.5])
                self.assertAlmostEqual(both["noise_floor_db"], FLOOR_DB, delta=3)
                distances = numpy.linalg.norm(
                    Maps.places_m(measured[1:])[:, None] - Maps.places_m(simulated)[None], axis=2)
                self.assertAlmostEqual(both["chamfer_m"], (distances.min(0).mean() + distances.min(1).mean()) / 2,
                                       places=9)

    def test_parameters_out_of_range_are_refused(self):
        for parameter, words in {"_cfar_kind:=go": "'go' is unknown; allowed: ca, os",
                                 "_cfar_false_alarm_rate:=0": "allowed: 1e-12 to 0.5",
                                 "_cfar_guard_beams:=1.5": "allowed: 0 to 64"}.items():
            done = subprocess.run([find_program("mmradartwin_attribution", "attribution_node"), parameter,
                                   "__name:=refusing_" + parameter[1:6]], env=self.environment, text=True,
                                  capture_output=True, timeout=PATIENCE_S, check=False)
            said = done.stdout + done.stderr
            self.assertEqual(done.returncode, 2, said)
            self.assertIn(parameter[1:].split(":=", maxsplit=1)[0], said)
            self.assertIn(words, said)
            subprocess.run(["rosparam", "delete", "/refusing_" + parameter[1:6]], env=self.environment,
                           capture_output=True, timeout=PATIENCE_S, check=False)


if __name__ == "__main__":
    unittest.main()
