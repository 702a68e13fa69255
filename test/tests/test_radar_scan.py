"""Points as radar_msgs/RadarScan. The package is not Debian's: the test makes it of its public definition."""
import json
import math
import os
import subprocess
import sys
import unittest

import rospkg
from genpy import generate_initpy
from genpy.generator import MsgGenerator

from in_folder import InFolder
from mmradartwin_tests.installed_programs import find_program
from test_launch_files import end, free_port, start_master
from wait_for import PATIENCE_S

# Of radar_msgs 0.1.0, whose comments are left out.
DEFINITION = {"RadarReturn": "float32 range\nfloat32 azimuth\nfloat32 elevation\nfloat32 doppler_velocity\n"
                             "float32 amplitude\n",
              "RadarScan": "std_msgs/Header header\nradar_msgs/RadarReturn[] returns\n"}
CONVERTER = find_program("mmradartwin_dsp", "points_to_radar_scan.py")

# In a process of its own: rospy knows one master for as long as it lives. Sends points until a scan comes back.
EXCHANGE = """
import math, json, struct, threading, rospy
from radar_msgs.msg import RadarScan
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
rospy.init_node("exchange")
came, seen = threading.Event(), []
def keep(scan):
    seen.append(scan)
    came.set()
subscriber = rospy.Subscriber("/radar/scan", RadarScan, keep)
publisher = rospy.Publisher("/radar/points", PointCloud2, queue_size=1)
names = ["x", "y", "z", "snr_db", "range_m", "azimuth_deg", "radial_speed_m_s", "power_db"]
fields = [PointField(name, 4 * i, PointField.FLOAT32, 1) for i, name in enumerate(names)]
points = [[2.9, -0.4, 0, 55, 2.93, -7, 0.5625, -63.75], [5, 0, 0, 34, 5.25, 30, math.nan, -59]]
cloud = point_cloud2.create_cloud(Header(stamp=rospy.Time(7), frame_id="radar_link"), fields, points)
while not came.wait(0.1):
    publisher.publish(cloud)
scan = seen[0]
print(json.dumps({"stamp": scan.header.stamp.to_sec(), "frame": scan.header.frame_id,
                  "returns": [[getattr(r, name) for name in r.__slots__] for r in scan.returns]}))
"""


@unittest.skipIf(CONVERTER is None, "points_to_radar_scan.py is not built in this workspace")
class RadarScans(InFolder):
    def make_radar_msgs(self):
        """Writes the package where PYTHONPATH of self.environment finds it."""
        files = []
        for name, text in DEFINITION.items():
            files.append(self.at(name + ".msg"))
            with open(files[-1], "w", encoding="ascii") as file:
                file.write(text)
        out = self.at("python", "radar_msgs", "msg")
        os.makedirs(out)
        standard = os.path.join(rospkg.RosPack().get_path("std_msgs"), "msg")
        self.assertEqual(MsgGenerator().generate_messages("radar_msgs", files, out,
                                                          {"radar_msgs": [self.folder], "std_msgs": [standard]}), 0)
        generate_initpy.write_modules(out)
        with open(self.at("python", "radar_msgs", "__init__.py"), "w", encoding="ascii"):
            pass

    def setUp(self):
        super().setUp()
        self.environment = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{free_port()}", ROS_IP="127.0.0.1",
                                ROS_HOME=self.folder,
                                PYTHONPATH=self.at("python") + os.pathsep + os.environ.get("PYTHONPATH", ""))

    def test_returns_are_the_points(self):
        self.make_radar_msgs()
        self.addCleanup(end, start_master(self.environment))
        converter = subprocess.Popen([CONVERTER], env=self.environment)
        self.addCleanup(end, converter)
        done = subprocess.run([sys.executable, "-c", EXCHANGE], env=self.environment, text=True, capture_output=True,
                              timeout=PATIENCE_S, check=False)
        self.assertEqual(done.returncode, 0, done.stderr[-3000:])
        nan, scan = math.nan, json.loads(done.stdout)
        self.assertEqual((scan["stamp"], scan["frame"]), (7, "radar_link"))
        first, second = scan["returns"]
        for found, expected in zip(first + second, [2.93, math.radians(-7), 0, 0.5625, -63.75,
                                                    5.25, math.radians(30), 0, nan, -59]):
            if math.isnan(expected):
                self.assertTrue(math.isnan(found))
            else:
                self.assertAlmostEqual(found, expected, places=5)

    def test_without_radar_msgs_one_line_says_what_to_install(self):
        done = subprocess.run([CONVERTER], env=self.environment, text=True, capture_output=True, timeout=PATIENCE_S,
                              check=False)
        self.assertEqual(done.returncode, 1)
        self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        for word in ("radar_msgs is not installed", "github.com/ros-perception/radar_msgs", "ros-noetic-radar-msgs"):
            self.assertIn(word, done.stderr)


if __name__ == "__main__":
    unittest.main()
