#!/usr/bin/env python3
"""Points: with their speeds of frames in dsp_node, of simulated maps in attribution_node, and how both agree."""
import json
import math
import os
import subprocess
import sys
import unittest

import numpy

from in_folder import InFolder
from mmradartwin_tests.installed_programs import find_program
from test_launch_files import end, free_port, start_master
from wait_for import PATIENCE_S
from walking_points import Recording

# Below, in processes of their own: rospy knows one master for as long as it lives. What both have in common, and a
# radar whose parts that differ come as JSON.
COMMON = """
import hashlib, io, json, math, struct, sys, threading, rospy
from geometry_msgs.msg import Point
from mmradartwin_msgs.msg import AdcCube, DetectionAgreement, RadarConfig, RangeAngleMap, RangeDopplerMap
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Image, PointCloud2
from sensor_msgs.point_cloud2 import read_points
rospy.init_node("exchange")
given = json.loads(sys.stdin.readline())
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
                    adc_start_s=6e-6, loops_per_frame=given["loops"], frame_period_s=0.05, layout="4lane", iq_order="iq",
                    tx_position_m=[Point(0, 4 * k * pitch, 0) for k in range(2)],
                    rx_position_m=[Point(0, k * pitch, 0) for k in range(4)])
radar.idle_s, radar.ramp_end_s = given["idle_s"], given["ramp_end_s"]
radar.rx_gain_db = radar.tx_backoff_db = math.nan
buffer = io.BytesIO()
radar.serialize(buffer)
radar_hash = int.from_bytes(hashlib.sha256(buffer.getvalue()).digest()[:8], "little")
def told(cloud):
    return {"frame": cloud.header.frame_id, "stamp": cloud.header.stamp.to_sec(),
            "fields": [f.name for f in cloud.fields], "points": list(read_points(cloud))}
"""

# Takes both maps, and prints the points of the simulated one and the agreement.
OF_MAPS = COMMON + """
def message(source):
    map = RangeAngleMap(radar_hash=radar_hash, source=source, frames=1, **given["axes"],
                        power_db=given["maps"][source])
    map.header.stamp, map.header.frame_id, map.T_map_radar.orientation.w = rospy.Time(100), "radar_link", 1
    return map
subscribers = [rospy.Subscriber("/twin/points", PointCloud2, lambda m: keep("twin", m)),
               rospy.Subscriber("/attribution/detection_agreement", DetectionAgreement, lambda m: keep("both", m))]
publishers = [rospy.Publisher(name, type, queue_size=10) for name, type in (
    ("/radar/config", RadarConfig), ("/radar/range_angle", RangeAngleMap), ("/twin/range_angle", RangeAngleMap))]
wait_for(lambda: all(c.get_num_connections() == 1 for c in subscribers + publishers))
publishers[0].publish(radar)
# Nothing says when the radar was taken in, and maps of before go without points.
while not {"twin", "both"} <= set(seen):
    publishers[1].publish(message(0))
    publishers[2].publish(message(1))
    rospy.rostime.wallsleep(0.1)
twin, both = wanted("twin", "both")
print(json.dumps([told(twin), {name: getattr(both, name) for name in both.__slots__[1:]}]))
"""

# Takes one frame, and prints points, the range-Doppler map, its picture and that of the range-angle map, and warnings.
OF_A_FRAME = COMMON + """
warnings = []
subscribers = [rospy.Subscriber("/radar/points", PointCloud2, lambda m: keep("points", m)),
               rospy.Subscriber("/radar/range_doppler", RangeDopplerMap, lambda m: keep("doppler", m)),
               rospy.Subscriber("/radar/range_doppler/image", Image, lambda m: keep("doppler_image", m)),
               rospy.Subscriber("/radar/range_angle", RangeAngleMap, lambda m: keep("angle", m)),
               rospy.Subscriber("/radar/range_angle/image", Image, lambda m: keep("angle_image", m)),
               rospy.Subscriber("/rosout", Log, lambda m: m.level >= Log.WARN and warnings.append(m.msg))]
publishers = [rospy.Publisher("/radar/config", RadarConfig, queue_size=1, latch=True),
              rospy.Publisher("/radar/adc", AdcCube, queue_size=10)]
publishers[0].publish(radar)
wait_for(lambda: all(c.get_num_connections() > 0 for c in subscribers + publishers))
cube = AdcCube(radar_hash=radar_hash, chirps=2 * given["loops"], samples_per_chirp=64, receivers=4,
               samples=given["samples"], chirp_valid=[1] * 2 * given["loops"])
cube.header.frame_id = "radar_link"
keys = ["points", "angle", "angle_image"] + (["doppler", "doppler_image"] if given["speeds"] else [])
# Frames of before the radar is taken in are left out; then so many more as show that nothing is said again.
frames = 0
while not set(keys) <= set(seen) or frames < given["frames"]:
    cube.header.stamp = rospy.Time(100 + frames)
    publishers[1].publish(cube)
    frames += 1
    rospy.rostime.wallsleep(0.1)
def image(message):
    return {"shape": [message.height, message.width], "encoding": message.encoding,
            "values": [v for (v,) in struct.iter_unpack("<f", message.data)]}
doppler, angle = seen.get("doppler"), seen["angle"]
print(json.dumps({"points": told(seen["points"]), "angle": list(angle.power_db), "angle_image": image(seen["angle_image"]),
                  "doppler": doppler and {name: list(getattr(doppler, name))
                                          for name in ("range_m", "radial_speed_m_s", "power_db")},
                  "doppler_image": doppler and image(seen["doppler_image"]), "warnings": warnings}))
"""

FIELDS = ["x", "y", "z", "snr_db", "range_m", "azimuth_deg", "radial_speed_m_s", "power_db"]
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


def in_order_of_messages(recording):
    """Samples of the first frame [chirp][sample][rx][I, Q], which a capture of four lanes has as [I of all rx][Q of all]."""
    raw = numpy.frombuffer(recording.payload(), "<i2").reshape(recording.frames, -1, 64, 2, 4)
    return raw[0].transpose(0, 1, 3, 2).ravel()


class Points(InFolder):
    def setUp(self):
        super().setUp()
        self.environment = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{free_port()}", ROS_IP="127.0.0.1",
                                ROS_HOME=self.folder)
        self.addCleanup(end, start_master(self.environment))

    def exchanged(self, script, given, package, program, *parameters):
        """What the script prints, to which a node of ours answers."""
        node = subprocess.Popen([find_program(package, program), *parameters], env=self.environment)
        self.addCleanup(end, node)
        done = subprocess.run([sys.executable, "-c", script], env=self.environment, input=json.dumps(given) + "\n",
                              text=True, capture_output=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(done.returncode, 0, done.stderr[-3000:])
        end(node)
        return json.loads(done.stdout)

    def of_maps(self, measured_db, simulated_db, *parameters):
        """What comes of both maps: points of the simulated one, and how they agree with those of the measured one."""
        given = {"axes": {"range_m": Maps.range_m.tolist(), "azimuth_rad": Maps.azimuth_rad.tolist()},
                 "maps": [measured_db.ravel().tolist(), simulated_db.ravel().tolist()],
                 "loops": 1, "idle_s": math.nan, "ramp_end_s": math.nan}
        return self.exchanged(OF_MAPS, given, "mmradartwin_attribution", "attribution_node", *parameters)

    def of_a_frame(self, recording, frames):
        """What comes of a frame that is sent so often at least."""
        given = {"loops": recording.loops, "idle_s": recording.chirp_s - 20e-6, "ramp_end_s": 20e-6,
                 "samples": in_order_of_messages(recording).tolist(), "speeds": recording.loops >= 8, "frames": frames}
        # There is no tf here, for which nobody is to wait.
        return self.exchanged(OF_A_FRAME, given, "mmradartwin_dsp", "dsp_node", "_pose_timeout_s:=0")

    def assert_points(self, cloud, targets):
        self.assertEqual((cloud["frame"], cloud["stamp"], cloud["fields"]), ("radar_link", 100, FIELDS))
        points = numpy.array(cloud["points"])
        self.assertTrue(numpy.isnan(points[:, 6]).all(), "a twin stands still, and no frame told it")
        points = points[:, :6]
        expected = numpy.column_stack([
            Maps.places_m(targets), numpy.zeros(len(targets)), [level_db - FLOOR_DB for _, _, level_db in targets],
            [Maps.range_m[r] for r, _, _ in targets], [numpy.degrees(Maps.azimuth_rad[a]) for _, a, _ in targets]])
        self.assertEqual(points.shape, expected.shape, points)
        numpy.testing.assert_allclose(numpy.delete(points, 3, 1), numpy.delete(expected, 3, 1), atol=1e-4)
        numpy.testing.assert_allclose(points[:, 3], expected[:, 3], atol=3)  # of an estimated noise

    def test_targets_of_a_simulated_map_become_points_that_are_compared(self):
        """The twin's level is another, and a target in the near range is not compared."""
        noise_db = FLOOR_DB + 10 * numpy.log10(numpy.random.default_rng(4).exponential(size=(64, 64)))
        measured = [(1, 32, -58), (20, 32, -50), (40, 40, -60)]
        # One a bin farther, one that is not measured, one that no receiver would see in its noise.
        simulated = [(21, 32, -50), (50, 10, -55)]
        unseen = (36, 55, -90)
        for kind in ("ca", "os"):
            with self.subTest(kind):
                twin, both = self.of_maps(Maps.with_targets(noise_db, measured),
                                          Maps.with_targets(numpy.full((64, 64), -200.0), [*simulated, unseen]) - 40,
                                          "_cfar_kind:=" + kind, "_cfar_false_alarm_rate:=1e-7")
                self.assert_points(twin, simulated)
                self.assertEqual([both[name] for name in ("measured", "simulated", "matched", "radius_m", "precision",
                                                          "recall")], [2, 2, 1, 0.5, 0.5, 0.5])
                self.assertAlmostEqual(both["noise_floor_db"], FLOOR_DB, delta=3)
                distances = numpy.linalg.norm(
                    Maps.places_m(measured[1:])[:, None] - Maps.places_m(simulated)[None], axis=2)
                self.assertAlmostEqual(both["chamfer_m"], (distances.min(0).mean() + distances.min(1).mean()) / 2,
                                       places=9)

    def test_points_of_frames_with_many_loops_have_speeds(self):
        recording = Recording(1, 64, noise=20, seed=3, chirp_s=120e-6)
        recording.stands(6.0, 10, 400).walks(3.0, -25, 1.0, 100).walks(4.5, 30, -0.75, 100)
        came = self.of_a_frame(recording, 2)
        self.assertEqual(came["points"]["fields"], FIELDS)
        points = numpy.array(came["points"]["points"])
        speed_bin = 299792458 / 77.93e9 / (2 * 64 * 2 * 120e-6)
        for range_m, azimuth_deg, speed in ((6.0, 10, 0), (3.0, -25, 1.0), (4.5, 30, -0.75)):
            there, = points[(abs(points[:, 4] - range_m) < 0.16) & (abs(points[:, 5] - azimuth_deg) < 3)]
            self.assertAlmostEqual(there[6], speed, delta=0.51 * speed_bin)
            self.assertGreater(there[3], 25)
        self.assertEqual(len(points), 3)
        self.assert_range_doppler(came, speed_bin)
        numpy.testing.assert_array_equal(came["angle_image"]["values"], came["angle"])
        self.assertEqual((came["angle_image"]["shape"], came["angle_image"]["encoding"]), ([64, 64], "32FC1"))

    def assert_range_doppler(self, came, speed_bin):
        doppler = {name: numpy.array(values) for name, values in came["doppler"].items()}
        numpy.testing.assert_allclose(doppler["radial_speed_m_s"], numpy.arange(-32, 32) * speed_bin, rtol=1e-3)
        numpy.testing.assert_allclose(doppler["range_m"], Maps.range_m)
        levels = doppler["power_db"].reshape(64, 64)
        self.assertEqual((came["doppler_image"]["shape"], came["doppler_image"]["encoding"]), ([64, 64], "32FC1"))
        numpy.testing.assert_array_equal(came["doppler_image"]["values"], doppler["power_db"])
        for range_m, speed, amplitude in ((6.0, 0, 400), (3.0, 1.0, 100), (4.5, -0.75, 100)):
            row = levels[round(range_m / Maps.range_m[1])]
            self.assertLess(abs(doppler["radial_speed_m_s"][row.argmax()] - speed), 0.51 * speed_bin)
            self.assertAlmostEqual(row.max(), 20 * numpy.log10(amplitude / 32768), delta=3.5)  # between the bins

    def test_frames_of_one_loop_have_points_without_speed_and_that_is_said_once(self):
        came = self.of_a_frame(Recording(1, 1, noise=20, seed=3).stands(6.0, 10, 400), 12)
        points = numpy.array(came["points"]["points"])
        self.assertEqual(len(points), 1)
        self.assertTrue(numpy.isnan(points[0, 6]))
        self.assertIsNone(came["doppler"])
        said = [line for line in came["warnings"] if "range_doppler" in line]
        self.assertEqual(said, ["radar/range_doppler is not published: frames have 1 loop, and speeds need 8 or more "
                                "(loops_per_frame)"])

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
