#!/usr/bin/env python3
"""Nodes go on where the ROS master is restarted, and whoever comes later finds them."""
import os
import signal
import subprocess
import sys
import unittest
import xmlrpc.client

import rosgraph

from in_folder import InFolder
from mmradartwin_tests.installed_programs import find_program
from test_launch_files import end, free_port, start_master
from wait_for import wait_for

SCENE = "package://mmradartwin_config/office/scene.yaml"
RADAR = "package://mmradartwin_config/radar.yaml"
# In processes of their own: rospy knows one master for as long as it lives.
APPLY = """
import rospy
from mmradartwin_msgs.srv import ApplyTwin
rospy.wait_for_service("/twin/apply", 60)
print(rospy.ServiceProxy("/twin/apply", ApplyTwin)("/nowhere.yaml").message)
"""
ANNOUNCE = """
import rospy
from mmradartwin_msgs.msg import RadarConfig
rospy.init_node("announcer")
publisher = rospy.Publisher("/radar/config", RadarConfig, queue_size=1, latch=True)
print("announced", flush=True)
rospy.spin()
"""


class RestartedMaster(InFolder):
    def setUp(self):
        super().setUp()
        self.uri = f"http://127.0.0.1:{free_port()}"
        self.environment = dict(os.environ, ROS_MASTER_URI=self.uri, ROS_IP="127.0.0.1", ROS_HOME=self.at("ros"),
                                ROSCONSOLE_STDOUT_LINE_BUFFERED="1")
        self.master = self.new_master()

    def new_master(self):
        master = start_master(self.environment)
        self.addCleanup(end, master)
        return master

    def node(self, name, *command):
        with open(self.at(name + ".log"), "w", encoding="utf-8") as log:
            node = subprocess.Popen(command, env=self.environment, stdout=log, stderr=log)
        self.addCleanup(end, node)
        return node

    def text(self, name):
        with open(self.at(name + ".log"), encoding="utf-8") as file:
            return file.read()

    def asked(self, method, *arguments):
        """The master's answer, None where it has none."""
        try:
            return getattr(rosgraph.Master("/test", self.uri), method)(*arguments)
        except (OSError, rosgraph.MasterException):
            return None

    def connected(self, node, topic):
        """True where the node hears a publisher of the topic."""
        uri = self.asked("lookupNode", node)
        if not uri:
            return False
        with xmlrpc.client.ServerProxy(uri) as proxy:
            return any(c[2] == "i" and c[4] == topic for c in proxy.getBusInfo("/test")[2])

    def apply(self):
        run = subprocess.run([sys.executable, "-c", APPLY], env=self.environment, capture_output=True, text=True,
                             timeout=120, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        return run.stdout

    def test_services_parameters_and_topics_are_known_to_the_next_master(self):
        rosgraph.Master("/test", self.uri).setParam("/use_sim_time", True)
        nodes = {"twin": self.node("twin", find_program("mmradartwin_sim", "twin_node"), "_scene:=" + SCENE,
                                   "_radar:=" + RADAR),
                 "signal_chain": self.node("signal_chain", find_program("mmradartwin_dsp", "dsp_node"),
                                           "_average_frames:=7")}
        wait_for(lambda: self.asked("lookupService", "/twin/apply"), lambda: self.text("twin"))
        wait_for(lambda: self.connected("/signal_chain", "/twin/grid"), lambda: self.text("signal_chain"))
        self.assertIn("lies below no folder", self.apply())

        end(self.master)
        for name in nodes:
            wait_for(lambda name=name: "the ROS master is gone" in self.text(name), lambda name=name: self.text(name))
        # A publisher that registers before those who listen have done so again.
        for node in nodes.values():
            node.send_signal(signal.SIGSTOP)
        self.new_master()
        self.node("announcer", sys.executable, "-c", ANNOUNCE)
        wait_for(lambda: "announced" in self.text("announcer"), lambda: self.text("announcer"))
        for node in nodes.values():
            node.send_signal(signal.SIGCONT)

        for name in nodes:
            wait_for(lambda name=name: "registered anew" in self.text(name), lambda name=name: self.text(name))
            self.assertEqual(self.text(name).count("registered anew"), 1)
            wait_for(lambda name=name: self.connected("/" + name, "/radar/config"), lambda name=name: self.text(name))
        self.assertTrue(self.connected("/signal_chain", "/twin/grid"), "a connection that stood was given up")
        self.assertIn("lies below no folder", self.apply())
        self.assertEqual(self.asked("getParam", "/signal_chain/average_frames"), 7)
        self.assertEqual(self.asked("getParam", "/twin/scene"), SCENE)
        self.assertIs(self.asked("getParam", "/use_sim_time"), True)
        publishers, subscribers, services = self.asked("getSystemState")
        self.assertIn("/twin", dict(publishers)["/twin/grid"])
        self.assertIn("/signal_chain", dict(subscribers)["/twin/grid"])
        self.assertIn("/signal_chain/get_loggers", dict(services))
        for name, node in nodes.items():
            self.assertIsNone(node.poll(), self.text(name))


if __name__ == "__main__":
    unittest.main()
