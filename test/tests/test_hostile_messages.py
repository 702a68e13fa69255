#!/usr/bin/env python3
"""Messages and requests that no radar sends: nodes refuse them in a line and go on."""
import os
import subprocess
import sys
import time
import unittest

from in_folder import InFolder
from mmradartwin_tests.installed_programs import find_program
from test_launch_files import end, free_port, start_master
from wait_for import wait_for

# Runs in a process of its own: rospy knows one master for as long as it lives.
PUBLISH = """
import sys, time, rospy
from mmradartwin_msgs.msg import AdcCube, RadarConfig, Session, SessionFile
rospy.init_node("hostile", anonymous=True)
def send(topic, message):
    publisher = rospy.Publisher(topic, type(message), queue_size=10, latch=True)
    while publisher.get_num_connections() == 0:
        time.sleep(0.05)
    publisher.publish(message)
    time.sleep(1)
"""
CUBES = PUBLISH + """
radar = RadarConfig()
send("radar/config", radar)
for seconds in (1000, 4000000000, 4294967295, 1001):
    cube = AdcCube()
    cube.header.stamp, cube.header.frame_id = rospy.Time(seconds), "radar_link"
    send("radar/adc", cube)
"""
FUTURE = PUBLISH + """
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage
T = TransformStamped()
T.header.stamp, T.header.frame_id, T.child_frame_id = rospy.Time.now() + rospy.Duration(3600), "map", "trolley"
T.transform.rotation.w = 1
publisher = rospy.Publisher("/tf", TFMessage, queue_size=10)
while publisher.get_num_connections() < int(sys.argv[1]):
    time.sleep(0.05)
publisher.publish(TFMessage([T]))
time.sleep(1)
"""
SESSIONS = PUBLISH + """
for names in (["session.yaml", "a", "a/b"], ["."], ["session.yaml", "x" * 5000], ["../outside"], ["/outside"]):
    send("session", Session(files=[SessionFile(name=name, data=b"1") for name in names]))
"""
APPLY = """
import sys, rospy
from mmradartwin_msgs.srv import ApplyTwin
rospy.wait_for_service("twin/apply", 120)
for file in sys.argv[1:]:
    print(repr(rospy.ServiceProxy("twin/apply", ApplyTwin)(file).message))
"""


class HostileMessages(InFolder):
    def setUp(self):
        super().setUp()
        self.environment = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{free_port()}", ROS_IP="127.0.0.1",
                                ROS_HOME=self.at("ros"), ROSCONSOLE_STDOUT_LINE_BUFFERED="1")
        self.addCleanup(end, start_master(self.environment))

    def node(self, package, program, *arguments):
        with open(self.at(program + ".log"), "w", encoding="utf-8") as log:
            node = subprocess.Popen([find_program(package, program), *arguments], env=self.environment, stdout=log,
                                    stderr=log)
        self.addCleanup(end, node)
        return node

    def text(self, program):
        with open(self.at(program + ".log"), encoding="utf-8") as file:
            return file.read()

    def python(self, script, *arguments):
        done = subprocess.run([sys.executable, "-c", script, *arguments], env=self.environment, capture_output=True,
                              text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_stamps_that_no_clock_has_end_no_node(self):
        nodes = [self.node("mmradartwin_dsp", "dsp_node"), self.node("mmradartwin_attribution", "diagnosis_node")]
        self.python(CUBES)
        wait_for(lambda: "is no time" in self.text("diagnosis_node"), lambda: self.text("diagnosis_node"), 60)
        for node in nodes:
            self.assertIsNone(node.poll(), self.text("dsp_node") + self.text("diagnosis_node"))

    def test_transforms_of_the_future_are_left_out_by_every_reader(self):
        nodes = {"dsp_node": self.node("mmradartwin_dsp", "dsp_node"),
                 "twin_node": self.node("mmradartwin_sim", "twin_node"),
                 "room_pose": self.node("mmradartwin_sim", "room_pose",
                                        "_scene:=package://mmradartwin_config/office/scene.yaml"),
                 "diagnosis_node": self.node("mmradartwin_attribution", "diagnosis_node")}
        self.python(FUTURE, str(len(nodes)))
        for name, node in nodes.items():
            wait_for(lambda name=name: "map -> trolley of /hostile" in self.text(name), lambda name=name: self.text(name), 60)
            self.assertIn("ahead of this computer's clock", self.text(name))
            self.assertIsNone(node.poll(), self.text(name))

    def test_sessions_that_cannot_be_unpacked_end_no_node(self):
        nodes = [self.node("mmradartwin_sim", "twin_node"), self.node("mmradartwin_attribution", "diagnosis_node"),
                 self.node("mmradartwin_attribution", "attribution_node")]
        self.python(SESSIONS)
        wait_for(lambda: "session refused" in self.text("twin_node"), lambda: self.text("twin_node"), 60)
        for node in nodes:
            self.assertIsNone(node.poll(), self.text("twin_node") + self.text("diagnosis_node"))

    def test_a_twin_is_applied_from_allowed_folders_alone_and_no_other_file_is_quoted(self):
        os.makedirs(self.at("allowed"))
        secret, pipe, inside = self.at("secret.yaml"), self.at("allowed", "pipe.yaml"), self.at("allowed", "mine.yaml")
        for path in (secret, inside):
            with open(path, "w", encoding="ascii") as file:
                file.write("hidden_word: 1\n")
        os.mkfifo(pipe)
        os.symlink(secret, self.at("allowed", "link.yaml"))
        node = self.node("mmradartwin_sim", "twin_node", "_apply_folder:=" + self.at("allowed"),
                         "_radar:=package://mmradartwin_config/radar.yaml",
                         "_scene:=package://mmradartwin_config/office/scene.yaml")
        begin = time.monotonic()
        answers = self.python(APPLY, secret, self.at("no_such.yaml"), self.at("allowed", "..", "secret.yaml"),
                              self.at("allowed", "link.yaml"), "/etc/shadow", pipe, inside).splitlines()
        self.assertLess(time.monotonic() - begin, 120)
        for answer in answers[:5]:
            self.assertIn("lies below no folder", answer)
        for answer in answers[:6]:
            self.assertNotIn("hidden_word", answer)
            self.assertNotIn("root:", answer)
        self.assertIn("is no file NAME.yaml", answers[5])
        self.assertIn("hidden_word", answers[6])  # the user's own file: what is wrong with it
        self.assertIsNone(node.poll(), self.text("twin_node"))


if __name__ == "__main__":
    unittest.main()
