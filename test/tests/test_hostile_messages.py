#!/usr/bin/env python3
"""Messages and requests that no radar sends: nodes refuse them in a line and go on."""
import os
import subprocess
import sys
import time
import unittest

import rospkg
import yaml

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
EDGES = (1000, 4000000000, 4294967295, 2147483647, 0, 1001)  # s
CUBES = PUBLISH + f"EDGES = {EDGES}" + """
from mmradartwin_msgs.msg import RangeAngleMap, ReceiveGrid
from mmradartwin_tests.moving_bag import config_message
from mmradartwin_tests.radar import Radar
from sensor_msgs.msg import Imu, PointCloud2, PointField
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage
radar, radar_hash = config_message(Radar())
send("radar/config", radar)
def cube():
    return AdcCube(radar_hash=radar_hash, chirps=2, samples_per_chirp=64, receivers=4, samples=[1, 2] * 512,
                   chirp_valid=bytes([1, 1]))
def cloud(width=1, step=12):
    return PointCloud2(width=width, height=1, point_step=step, row_step=12, data=bytes(12), is_dense=True, fields=[
        PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1) for i, name in enumerate("xyz")])
kinds = {"radar/adc": cube, "radar/grid": ReceiveGrid, "radar/range_angle": RangeAngleMap, "twin/grid": ReceiveGrid,
         "twin/range_angle": RangeAngleMap, "cloud": cloud, "imu": Imu,
         "/tf": lambda: TFMessage([TransformStamped(child_frame_id="radar_link")])}
publishers = {topic: rospy.Publisher(topic, type(make()), queue_size=20) for topic, make in kinds.items()}
listeners = {"radar/adc": 2, "/tf": 5}
while any(p.get_num_connections() < listeners.get(topic, 1) for topic, p in publishers.items()):
    time.sleep(0.05)
for seconds in EDGES:
    for topic, make in kinds.items():
        message = make()
        header = message.transforms[0].header if topic == "/tf" else message.header
        header.stamp, header.frame_id = rospy.Time(seconds), "map" if topic == "/tf" else "radar_link"
        if topic == "/tf":
            message.transforms[0].transform.rotation.w = 1
        publishers[topic].publish(message)
    time.sleep(0.3)
for wrong in 8 * (cloud(width=2**32 - 1), cloud(step=2**31), cloud(step=0)):  # longer than warnings are throttled
    wrong.header.stamp, wrong.header.frame_id = rospy.Time(1002), "radar_link"
    publishers["cloud"].publish(wrong)
    time.sleep(0.3)
"""
LARGE = PUBLISH + """
from mmradartwin_tests.moving_bag import config_message
from mmradartwin_tests.radar import Radar
send("radar/config", config_message(Radar(samples=128, loops=32768, frame_period_s=3.5))[0])
"""
# Rounds of one loop: in each, maps of both kinds for a while, then measured ones alone, as where tf ends.
ROUNDS = PUBLISH + """
import copy
from mmradartwin_msgs.msg import RangeAngleMap, Residuals
from mmradartwin_tests.moving_bag import config_message
from mmradartwin_tests.radar import Radar
radar, radar_hash = config_message(Radar())
send("radar/config", radar)
templates, residuals = [], []
keep = [rospy.Subscriber("radar/range_angle", RangeAngleMap, templates.append),
        rospy.Subscriber("attribution/residuals", Residuals, residuals.append)]
cubes = rospy.Publisher("radar/adc", AdcCube, queue_size=1)
while cubes.get_num_connections() == 0 or keep[0].get_num_connections() == 0 or keep[1].get_num_connections() == 0:
    time.sleep(0.05)
number = 0
while not templates:
    number += 1
    cube = AdcCube(radar_hash=radar_hash, chirps=2, samples_per_chirp=64, receivers=4, samples=[1, 2, 5, -7] * 256,
                   chirp_valid=bytes([1, 1]))
    cube.header.stamp, cube.header.frame_id = rospy.Time(number), "radar_link"
    cubes.publish(cube)
    time.sleep(0.2)
measured, simulated = (rospy.Publisher(topic, RangeAngleMap, queue_size=100)
                       for topic in ("radar/range_angle", "twin/range_angle"))
while measured.get_num_connections() < 2 or simulated.get_num_connections() == 0:
    time.sleep(0.05)
m = copy.deepcopy(templates[-1])
m.pose_valid = True
m.T_map_radar.position.x, m.T_map_radar.position.y, m.T_map_radar.position.z = 3, 3, 1
m.T_map_radar.orientation.w = 1
s = copy.deepcopy(m)
s.source = 1
# Until twin/scene is there nothing is compared.
while not residuals:
    number += 1
    for message, publisher in ((m, measured), (s, simulated)):
        message.header.stamp = rospy.Time(1000 + number)
        publisher.publish(message)
    time.sleep(0.2)
counts = []
for round_number in range(4):
    before = len(residuals)
    for i in range(110):
        m.header.stamp = s.header.stamp = rospy.Time.from_sec(900 + 0.05 * i)
        measured.publish(m)
        time.sleep(0.01)
        if i < 30:
            simulated.publish(s)
            time.sleep(0.01)
    time.sleep(1)
    counts.append(len(residuals) - before)
print(counts)
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
        radar = "package://mmradartwin_config/radar.yaml"
        scene = "_scene:=package://mmradartwin_config/office/scene.yaml"
        nodes = {"dsp_node": self.node("mmradartwin_dsp", "dsp_node"),
                 "diagnosis_node": self.node("mmradartwin_attribution", "diagnosis_node"),
                 "attribution_node": self.node("mmradartwin_attribution", "attribution_node"),
                 "twin_node": self.node("mmradartwin_sim", "twin_node", "_radar:=" + radar, scene),
                 "room_pose": self.node("mmradartwin_sim", "room_pose", scene, "_initial_pose:=3 3 0",
                                        "_camera_frame:=radar_link", "_publish_tf:=false"),
                 "driver_node": self.node("mmradartwin_driver", "driver_node", "_radar:=" + radar,
                                          "_card_ip:=127.77.3.2", "_host_ip:=127.77.3.1")}
        self.python(CUBES)
        for name in nodes.keys() - {"driver_node"}:
            wait_for(lambda name=name: "is no time" in self.text(name), lambda name=name: name + self.text(name), 60)
        wait_for(lambda: "are not those of its data" in self.text("room_pose"), lambda: self.text("room_pose"), 60)
        for name, node in nodes.items():
            self.assertIsNone(node.poll(), name + self.text(name))
        self.assertLess(self.text("dsp_node").count("is no time"), 2 * len(EDGES))

    def test_frames_that_take_all_memory_are_refused_from_files_and_messages(self):
        with open(os.path.join(rospkg.RosPack().get_path("mmradartwin_config"), "radar.yaml"), encoding="utf-8") as file:
            radar = yaml.safe_load(file)
        radar.update(samples_per_chirp=128, loops_per_frame=32768, frame_period_s=3.5)
        with open(self.at("large.yaml"), "w", encoding="ascii") as file:
            yaml.safe_dump(radar, file)
        with open(self.at("allowed.yaml"), "w", encoding="ascii") as file:
            yaml.safe_dump({**radar, "max_frame_mb": 128}, file)
        # Captures may have larger frames where their radar.yaml says so; messages may not, whatever it says.
        for name, source in (("large", self.at("large.yaml")), ("allowed", "radar/config")):
            driver = self.node("mmradartwin_driver", "driver_node", "_radar:=" + self.at(name + ".yaml"),
                               "_card_ip:=127.77.3.2", "_host_ip:=127.77.3.1", "_configure_card:=false")
            self.assertEqual(driver.wait(120), 2, self.text("driver_node"))
            said = [line for line in self.text("driver_node").split("\n") if line]
            self.assertEqual(len(said), 1, said)
            for word in (source + ": ", "max_frame_mb", "64 MiB", "65536 chirps", "128 complex samples", "128 MiB"):
                self.assertIn(word, said[0])
        chain = self.node("mmradartwin_dsp", "dsp_node")
        self.python(LARGE)
        wait_for(lambda: "max_frame_mb" in self.text("dsp_node"), lambda: self.text("dsp_node"), 60)
        self.assertIsNone(chain.poll(), self.text("dsp_node"))

    def test_rounds_of_a_loop_give_the_same_numbers(self):
        for package, program, *arguments in (
                ("mmradartwin_dsp", "dsp_node", "_pose_timeout_s:=0"), ("mmradartwin_attribution", "attribution_node"),
                ("mmradartwin_sim", "twin_node", "_rate_hz:=0",
                 "_scene:=package://mmradartwin_config/office/scene.yaml")):
            self.node(package, program, *arguments)
        self.assertEqual(self.python(ROUNDS).split("\n")[0], "[30, 30, 30, 30]", self.text("attribution_node"))

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
        # Nothing can be unpacked, as on a full disk.
        self.environment["TMPDIR"] = self.at("no_such_folder")
        full = self.node("mmradartwin_sim", "twin_node", "__name:=full")
        self.python(SESSIONS)
        wait_for(lambda: "session refused" in self.text("twin_node"), lambda: self.text("twin_node"), 60)
        self.assertIsNone(full.poll(), self.text("twin_node"))
        del self.environment["TMPDIR"]
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
        with open(self.at("allowed", "twin.yaml"), "w", encoding="ascii") as file:
            file.write("mechanisms: {}\nmistyped: 1\n")
        os.mkfifo(pipe)
        os.symlink(secret, self.at("allowed", "link.yaml"))
        node = self.node("mmradartwin_sim", "twin_node", "_apply_folder:=" + self.at("allowed"),
                         "_radar:=package://mmradartwin_config/radar.yaml",
                         "_scene:=package://mmradartwin_config/office/scene.yaml")
        begin = time.monotonic()
        answers = self.python(APPLY, secret, self.at("no_such.yaml"), self.at("allowed", "..", "secret.yaml"),
                              self.at("allowed", "link.yaml"), "/etc/shadow",
                              "package://mmradartwin_config/../../../../../../../../../../.." + secret, pipe, inside,
                              self.at("allowed", "twin.yaml")).splitlines()
        self.assertLess(time.monotonic() - begin, 120)
        for answer in answers[:6]:
            self.assertIn("lies below no folder", answer)
        for answer in answers[:8]:
            self.assertNotIn("hidden_word", answer)
            self.assertNotIn("root:", answer)
        self.assertIn("is no file NAME.yaml", answers[6])
        self.assertIn("is no twin.yaml", answers[7])
        self.assertIn("mistyped", answers[8])  # a twin: what is wrong with it
        self.assertIsNone(node.poll(), self.text("twin_node"))


if __name__ == "__main__":
    unittest.main()
