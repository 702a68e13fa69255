#!/usr/bin/env python3
"""rviz shows an actor where the twin simulates it, not where scene.yaml has it."""
import os
import subprocess
import time
import unittest

import numpy
import rosbag

from in_folder import InFolder
from mmradartwin_tests.installed_programs import find_program
from test_launch_files import Launched, end, free_port, start_master
from wait_for import wait_for

TWIN = """mechanisms:
  specular: {{max_bounces: 1}}
{more}"""
SHOWN_AGAIN_S = 8  # attribution shows a scene that changed within 5 s
MOVED = "  actor_moved: {actor: cabinet_north, dx_m: 0, dy_m: -0.5, dyaw_deg: 0}\n"


class MovedActors(InFolder):
    def setUp(self):
        super().setUp()
        self.environment = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{free_port()}", ROS_IP="127.0.0.1",
                                ROS_HOME=self.folder)
        self.addCleanup(end, start_master(self.environment))

    def start(self, *command):
        process = subprocess.Popen(command, env=self.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(end, process)
        return process

    def received(self, node, topic):
        """Messages that a node has had."""
        return sum(messages for _, messages in Launched.bus(self, node)[1].get(topic, []))

    def shown(self, name, more):
        """{namespace: [n, 3] points} that attribution shows of the scene, with this twin."""
        with open(self.at(name + ".yaml"), "w", encoding="ascii") as file:
            file.write(TWIN.format(more=more))
        attribution = self.start(find_program("mmradartwin_attribution", "attribution_node"))
        file = self.at(name + ".bag")
        recorder = self.start("rosbag", "record", "--quiet", "-O", file, "/attribution/scene_markers",
                              "__name:=recorder")
        twin = self.start(find_program("mmradartwin_sim", "twin_node"), "_base_folder:=" + self.folder,
                          "_radar:=package://mmradartwin_config/radar.yaml", f"_twin:={name}.yaml",
                          "_scene:=package://mmradartwin_config/office/scene.yaml")
        topic = "/twin/moved_scene" if more else "/twin/scene"
        wait_for(lambda: self.received("/attribution", topic), lambda: f"{topic}; twin_node: {twin.poll()}")
        wait_for(lambda: self.received("/recorder", "/attribution/scene_markers"), "markers of the scene")
        time.sleep(SHOWN_AGAIN_S)
        for process in (recorder, twin, attribution):
            end(process)
        with rosbag.Bag(file) as bag:
            markers = [message for _, message, _ in bag.read_messages()][-1].markers
        return {m.ns: numpy.array([[p.x, p.y, p.z] for p in m.points]) for m in markers if m.points}

    def test_an_actor_that_the_twin_moves_is_drawn_there(self):
        described, moved = self.shown("described", ""), self.shown("moved", MOVED)
        self.assertEqual(set(described), set(moved))
        steps = numpy.concatenate([moved[name] - described[name] for name in sorted(described)])
        stand = numpy.abs(steps).max(1) < 1e-6
        self.assertGreater(stand.sum(), 0)
        self.assertGreater((~stand).sum(), 0)
        numpy.testing.assert_allclose(steps[~stand], numpy.tile([0, -0.5, 0], ((~stand).sum(), 1)), atol=1e-6)


if __name__ == "__main__":
    unittest.main()
