#!/usr/bin/env python3
"""rviz with the shipped layout on a virtual screen: it loads the displays, shows maps as they come, and reports no error."""
import os
import re
import subprocess
import sys
import unittest

import numpy
import rospkg

from in_folder import InFolder
from mmradartwin_tests.virtual_screen import VirtualScreen
from test_demo_loop import picture_pixels
from test_launch_files import end, free_port, start_master
from wait_for import wait_for

# In a process of its own: rospy knows one master for as long as it lives. Each line of standard input is the echo of
# the maps from then on.
LISTEN = """
import sys, threading, rospy
rospy.init_node("maps")
echo = [0.0]
def listen():
    for line in sys.stdin:
        echo[0] = float(line)
threading.Thread(target=listen, daemon=True).start()
"""
# Publishes a pose and maps until it is ended; the echo is an angle in degrees.
PUBLISH = LISTEN + """
import math
from geometry_msgs.msg import TransformStamped
from mmradartwin_msgs.msg import RangeAngleMap, Residual, Residuals, ResponseRegion
from tf2_msgs.msg import TFMessage
topics = {"radar/range_angle": 0, "twin/range_angle": 1, "attribution/residual_map": 2}
publishers = {t: rospy.Publisher("/" + t, RangeAngleMap, queue_size=1) for t in topics}
residuals = rospy.Publisher("/attribution/residuals", Residuals, queue_size=1)
tf = rospy.Publisher("/tf", TFMessage, queue_size=1)
ranges = [0.1 * r for r in range(60)]
azimuths = [math.asin((a - 32) / 32) for a in range(64)]
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    now = rospy.Time.now()
    pose = TransformStamped()
    pose.header.stamp, pose.header.frame_id, pose.child_frame_id = now, "map", "radar_link"
    pose.transform.rotation.w = 1
    tf.publish(TFMessage([pose]))
    for topic, source in topics.items():
        m = RangeAngleMap(source=source, range_m=ranges, azimuth_rad=azimuths, frames=1, pose_valid=True)
        m.header.stamp, m.header.frame_id = now, "radar_link"
        away = [(r - 3) ** 2 / 0.5 + (math.degrees(a) - echo[0]) ** 2 / 100 for r in ranges for a in azimuths]
        m.power_db = [-20 - min(60, d) if source < 2 else 30 * math.exp(-d) for d in away]
        publishers[topic].publish(m)
    r = Residuals(pose="seven", range_m=ranges, azimuth_rad=azimuths)
    r.header.stamp, r.header.frame_id = now, "radar_link"
    r.residuals = [Residual(residual_class=2, measured_stronger=True, range_m=3, azimuth_rad=math.radians(echo[0]),
                            half_range_m=0.3, half_azimuth_rad=0.1, measured_db=0, simulated_db=-20, actor="wall")]
    r.regions = [ResponseRegion(range_m=4.5, azimuth_rad=0.3, half_range_m=0.3, half_azimuth_rad=0.1,
                                measured_strong=True, simulated_strong=True)]
    residuals.publish(r)
    rate.sleep()
"""
# The same of range-Doppler maps; the echo is a speed in m/s.
PUBLISH_SPEEDS = LISTEN + """
from mmradartwin_msgs.msg import RangeDopplerMap
publisher = rospy.Publisher("/radar/range_doppler", RangeDopplerMap, queue_size=1)
ranges, speeds = [0.1 * r for r in range(60)], [0.1 * d for d in range(-32, 32)]
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    m = RangeDopplerMap(range_m=ranges, radial_speed_m_s=speeds)
    m.header.stamp, m.header.frame_id = rospy.Time.now(), "radar_link"
    m.power_db = [-20 - min(60, (r - 3) ** 2 / 0.1 + (v - echo[0]) ** 2 / 0.01) for r in ranges for v in speeds]
    publisher.publish(m)
    rate.sleep()
"""
# rviz itself says so on this Debian, whatever it shows.
USUAL = ("media_export", "error while executing command", "XDG_RUNTIME_DIR")


def yellow(pixels):
    """Where pixels have the upper end of viridis."""
    return numpy.abs(pixels - numpy.array([253, 231, 37])).sum(axis=2) < 60


class Rviz(InFolder):
    """rviz and a publisher, which is told something by its standard input."""
    publish = PUBLISH

    def layout(self):
        return os.path.join(rospkg.RosPack().get_path("mmradartwin_config"), "rviz", "twin.rviz")

    def setUp(self):
        super().setUp()
        self.screen = VirtualScreen(1920, 1080)
        self.addCleanup(self.screen.close)
        self.environment = dict(self.screen.environment, ROS_MASTER_URI=f"http://127.0.0.1:{free_port()}",
                                ROS_IP="127.0.0.1", ROS_HOME=self.folder, ROSCONSOLE_STDOUT_LINE_BUFFERED="1")
        self.addCleanup(end, start_master(self.environment))
        self.log = open(self.at("rviz.log"), "w+", encoding="utf-8")
        self.addCleanup(self.log.close)
        self.rviz = subprocess.Popen(["rosrun", "rviz", "rviz", "-d", self.layout()], env=self.environment, stdout=self.log,
                                     stderr=subprocess.STDOUT, start_new_session=True)
        self.addCleanup(end, self.rviz)
        self.maps = subprocess.Popen([sys.executable, "-c", self.publish], env=self.environment, stdin=subprocess.PIPE,
                                     text=True)
        self.addCleanup(end, self.maps)
        self.addCleanup(self.maps.stdin.close)

    def said(self):
        with open(self.log.name, encoding="utf-8") as file:
            return file.read()

    def picture(self):
        return picture_pixels(self.screen.picture(self.at("screen.png")))

    def tell(self, value):
        self.maps.stdin.write(f"{value}\n")
        self.maps.stdin.flush()

    def yellow_column(self, rows):
        """Mean column of the window's right part, where the panels are, that holds a map's strongest level; None before."""
        self.assertIsNone(self.rviz.poll(), self.said())
        columns = numpy.flatnonzero(yellow(self.picture()[rows, 1470:1850]).sum(axis=0) > 3)
        return float(columns.mean()) if len(columns) > 3 else None

    def assert_no_problems(self):
        problems = [line for line in self.said().splitlines()
                    if re.search(r"error|exception|warn|fail", line, re.I) and not any(u in line for u in USUAL)]
        self.assertEqual(problems, [])


class Displays(Rviz):
    def column_of_echo(self):
        return self.yellow_column(slice(0, 680))

    def test_maps_are_shown_as_they_come(self):
        ahead = wait_for(self.column_of_echo, lambda: f"an echo in a panel; rviz: {self.said()[-2000:]}")
        for angle_deg in (30, -30):
            self.tell(angle_deg)

            def moved(angle_deg=angle_deg):
                column = self.column_of_echo()
                return column is not None and (column - ahead) * angle_deg < -30 * 30  # left is left
            wait_for(moved, f"the echo at {angle_deg} degrees")
        self.assert_scene_and_boxes()
        self.assert_no_problems()

    def assert_scene_and_boxes(self):
        pixels = self.picture()
        middle = pixels[80:840, 330:1440]
        # The fan on the floor has the upper colours of levels. A box stands on the map that is stronger, and on the residual.
        self.assertGreater(((middle[..., 1] > 130) & (middle[..., 1] > middle[..., 2] + 60)).sum(), 5000)
        magenta = numpy.abs(pixels[:, 1470:1850] - numpy.array([255, 140, 255])).sum(axis=2) < 60
        self.assertGreater(magenta[80:400].sum(), 30)
        self.assertEqual(magenta[430:720].sum(), 0)
        self.assertGreater(magenta[760:].sum(), 30)


class RangeAndSpeed(Rviz):
    publish = PUBLISH_SPEEDS

    def layout(self):
        """The shipped layout with this display switched on."""
        with open(super().layout(), encoding="utf-8") as file:
            before, found, after = file.read().partition("Class: mmradartwin_attribution/RangeDoppler\n")
        self.assertTrue(found)
        # Qt's state of the window has its panel by name, and then whether it is visible.
        panel = "Range and speed".encode("utf-16-be").hex()
        self.assertIn(panel + "00", after)
        after = after.replace("Enabled: false", "Enabled: true", 1).replace(panel + "00", panel + "01")
        with open(self.at("layout.rviz"), "w", encoding="utf-8") as file:
            file.write(before + found + after)
        return self.at("layout.rviz")

    def test_echo_stands_at_its_speed(self):
        def column():
            return self.yellow_column(slice(820, 1040))
        still = wait_for(column, lambda: f"an echo in the panel; rviz: {self.said()[-2000:]}")
        for speed_m_s in (0.6, -0.6):
            self.tell(speed_m_s)

            def moved(speed_m_s=speed_m_s):
                place = column()
                return place is not None and (place - still) * speed_m_s > 10  # away from the radar is right
            wait_for(moved, f"the echo at {speed_m_s} m/s")
        self.assert_no_problems()


if __name__ == "__main__":
    unittest.main()
