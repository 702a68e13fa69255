#!/usr/bin/env python3
"""Driver and signal chain in one nodelet manager: frames go from one to the other without being copied."""
import os
import shutil
import subprocess
import tempfile
import time
import unittest
import xmlrpc.client

import rosgraph

from mmradartwin_tests.installed_programs import find_program
from test_emulated_rig import wait_until
from test_launch_files import Launched

FRAMES = 60
LAUNCH = """
<launch>
  <node name="manager" pkg="nodelet" type="nodelet" args="manager" output="screen" />
  <node name="driver" pkg="nodelet" type="nodelet" args="load mmradartwin_driver/DriverNodelet manager" output="screen">
    <param name="radar" value="{session}/radar.yaml" type="str" />
    <param name="host_ip" value="127.201.9.1" type="str" />
    <param name="card_ip" value="127.201.9.2" type="str" />
  </node>
  <node name="signal_chain" pkg="nodelet" type="nodelet" args="load mmradartwin_dsp/SignalChainNodelet manager" />
  <node name="listener" pkg="rosbag" type="record" args="--quiet -O {folder}/grids.bag /radar/grid" />
  <node name="player" pkg="mmradartwin_driver" type="session_player" output="screen">
    <param name="session" value="{session}" type="str" />
    <param name="host_ip" value="127.201.9.1" type="str" />
    <param name="card_ip" value="127.201.9.2" type="str" />
    <param name="start_delay_s" value="3.0" type="double" />
  </node>
</launch>
"""


class Nodelets(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="mmradartwin_nodelets_")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.session = os.path.join(self.folder, "session")
        subprocess.run([find_program("mmradartwin_tests", "make_session.py"), "--output", self.session, "--locations", "1",
                        "--headings", "1", "--duplicates", "0", "--frames", str(FRAMES), "--seed", "31"],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=600)

    def bus(self, launched):
        """Of the manager's topics: {topic: bytes sent}, {topic: [(bytes, messages) of each connection]}."""
        try:
            uri = rosgraph.Master("/test", launched.environment["ROS_MASTER_URI"]).lookupNode("/manager")
            with xmlrpc.client.ServerProxy(uri) as node:
                sent, received = node.getBusStats("/test")[:2]  # as roscpp answers: without code and message
        except (OSError, rosgraph.MasterException, rosgraph.MasterError):
            return {}, {}
        return ({topic: sum(c[1] for c in connections) for topic, connections in sent},
                {topic: [tuple(c[1:3]) for c in connections] for topic, connections in received})

    def test_frames_are_handed_over_and_not_copied(self):
        file = os.path.join(self.folder, "nodelets.launch")
        with open(file, "w", encoding="ascii") as out:
            out.write(LAUNCH.format(session=self.session, folder=self.folder))
        with Launched(file, package=None) as launched:
            frames = lambda: sum(n for _, n in self.bus(launched)[1].get("/radar/adc", []))
            self.assertTrue(wait_until(lambda: frames() >= FRAMES // 2, 60), f"{self.bus(launched)}\n{launched.text()[-3000:]}")
            self.assertTrue(wait_until(lambda: self.bus(launched)[0].get("/radar/grid", 0) > 0, 60), launched.text()[-3000:])
            sent, received = self.bus(launched)
            # A player that is not told to exit stays, so that its latched messages do.
            self.assertTrue(wait_until(lambda: "has been played" in launched.text(), 120), launched.text()[-3000:])
            time.sleep(2)
            self.assertNotIn("has died", launched.text())
        # Nothing was serialised on the way: the counters of bytes say so, and count what goes to another process.
        self.assertEqual(len(received["/radar/adc"]), 1)
        self.assertEqual(received["/radar/adc"][0][0], 0, received)
        self.assertEqual(sent["/radar/adc"], 0, sent)
        self.assertGreater(sent["/radar/grid"], 8 * 2 * 8 * 64)


if __name__ == "__main__":
    unittest.main()
