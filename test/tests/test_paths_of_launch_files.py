#!/usr/bin/env python3
"""Relative paths of launch arguments, what is not there, and the end of a bag."""
import glob
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import rosbag

from mmradartwin_tests.installed_programs import find_program
from made_session import make_session
from test_launch_files import Launched
from wait_for import wait_for

QUIET = ("rviz:=false", "diagnosis:=false")


class CalledFrom(Launched):
    """roslaunch as a shell in this folder calls it."""

    def __init__(self, folder, *arguments, **more):
        before, here = os.environ.get("PWD"), os.getcwd()
        os.environ["PWD"], os.environ["ROS_HOME"] = folder, os.path.join(folder, "ros")
        os.environ["ROSCONSOLE_STDOUT_LINE_BUFFERED"] = "1"
        os.chdir(folder)
        try:
            super().__init__(*arguments, **more)
        finally:
            os.chdir(here)
            if before is not None:
                os.environ["PWD"] = before

    def text(self):
        return re.sub(r"\x1b\[[0-9;]*m", "", super().text())

    def wait_for_end(self):
        wait_for(lambda: self.process.poll() is not None, lambda: f"the launch's end:\n{self.text()[-3000:]}")
        return self.text()


class LaunchPaths(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="mmradartwin_paths_")
        make_session(os.path.join(cls.folder, "session"), 2, 30, "--duplicates", "0")
        subprocess.run([find_program("mmradartwin_dsp", "session_to_bag"), os.path.join(cls.folder, "session"),
                        os.path.join(cls.folder, "monday.bag")], check=True, capture_output=True, timeout=300)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    def called(self, *arguments, **more):
        return CalledFrom(self.folder, *arguments, **more)

    def test_relative_paths_are_seen_from_where_they_were_typed_and_all_stays_at_the_bags_end(self):
        with self.called("replay.launch", "bag:=monday.bag", "scene:=session/scene.yaml", *QUIET) as launched:
            launched.wait_for_text(f"twin of {self.folder}/session/scene.yaml")
            launched.wait_for_text("the bag is over; a diagnosis is possible now")
            self.assertLessEqual({"/player", "/twin", "/signal_chain", "/attribution"}, launched.state()[1])
            for words in ("died", "FATAL", "ERROR"):
                self.assertNotIn(words, launched.text())

    def test_a_replay_that_does_not_stay_ends_without_an_alarm(self):
        with self.called("replay.launch", "bag:=monday.bag", "stay:=false", *QUIET) as launched:
            text = launched.wait_for_end()
        for words in ("died", "FATAL", "ERROR", "REQUIRED"):
            self.assertNotIn(words, text)

    def test_a_bag_loops(self):
        with self.called("replay.launch", "bag:=monday.bag", "loop:=true", *QUIET) as launched:
            launched.wait_for_text("the ledger begins anew", 2)

    @unittest.skipUnless(importlib.util.find_spec("std_srvs"), "needs python3-std-srvs")
    def test_a_bag_begins_paused_and_goes_on(self):
        with self.called("replay.launch", "bag:=monday.bag", "pause:=true", *QUIET) as launched:
            launched.wait_for_text("the bag is paused")
            go_on = ("import rospy; from std_srvs.srv import SetBool; name = '/player/pause_playback'; "
                     "rospy.wait_for_service(name, 120); rospy.ServiceProxy(name, SetBool)(False)")
            subprocess.run([sys.executable, "-c", go_on], env=launched.environment, check=True, timeout=150)
            launched.wait_for_text("the bag is over")

    def test_what_is_missing_ends_the_launch_with_one_line_that_names_it(self):
        for arguments, missing in ((("replay.launch", "bag:=monday.bag", "scene:=no_scene.yaml"), "no_scene.yaml"),
                                   (("replay.launch", "bag:=monday.bag", "twin:=no_twin.yaml"), "no_twin.yaml"),
                                   (("replay.launch", "bag:=no_bag.bag"), "no_bag.bag"),
                                   (("live.launch", "radar:=no_radar.yaml"), "no_radar.yaml")):
            with self.subTest(missing=missing), self.called(*arguments, *QUIET) as launched:
                text = launched.wait_for_end()
                path = os.path.join(self.folder, missing)
                self.assertEqual(len([line for line in text.split("\n") if path in line and "FATAL" in line]), 1, text)
                self.assertIn("the launch ends", text)

    def test_a_scene_that_cannot_be_used_ends_the_launch(self):
        with open(os.path.join(self.folder, "broken.yaml"), "w", encoding="ascii") as file:
            file.write("meesh: room.obj\n")
        with self.called("replay.launch", "bag:=monday.bag", "scene:=broken.yaml", *QUIET) as launched:
            text = launched.wait_for_end()
        path = os.path.join(self.folder, "broken.yaml")
        self.assertEqual(len([line for line in text.split("\n") if path in line]), 1, text)
        self.assertIn("the launch ends", text)

    def test_a_report_without_a_bag_says_so(self):
        os.makedirs(os.path.join(self.folder, "report"), exist_ok=True)
        with self.called("inspect.launch", "results:=report", "rviz:=false") as launched:
            text = launched.wait_for_end()
        said = [line for line in text.split("\n") if "report/results.bag" in line and "FATAL" in line]
        self.assertEqual(len(said), 1, text)
        self.assertIn("--no-bag", said[0])

    def test_a_recording_says_its_name_as_replay_takes_it(self):
        with self.called("replay.launch", "bag:=monday.bag", "loop:=true", *QUIET) as replay:
            replay.wait_for_nodes({"/player"})
            with self.called("record.launch", "output:=tuesday", "min_free:=1M", port=replay.port) as recorder:
                recorder.wait_for_text("recording to ")
                recorder.wait_for_messages("/recorder", {"/radar/adc": 10})
                said = re.search(r"recording to (\S+\.bag) .*bag:=(\S+)\)", recorder.text())
        self.assertEqual(said[1], said[2])
        self.assertEqual(glob.glob(os.path.join(self.folder, "tuesday*.bag")), [said[1]])
        with rosbag.Bag(said[1]) as bag:
            self.assertGreater(bag.get_message_count(["radar/adc", "/radar/adc"]), 0)


if __name__ == "__main__":
    unittest.main()
