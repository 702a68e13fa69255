#!/usr/bin/env python3
"""Two radars on one master, each in a namespace and with frames of its own."""
import os
import shutil
import tempfile
import unittest

import rosbag

from made_session import make_session
from test_launch_files import Launched
from wait_for import wait_for

FRAMES = {"left": 160, "right": 180}
SIDES = {"left": 3, "right": 4}  # a network of this machine's own for each


class TwoRadars(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="mmradartwin_two_")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        for side, frames in FRAMES.items():
            make_session(os.path.join(self.folder, side), 1, frames, "--duplicates", "0")

    def launched(self, side, **more):
        """Ends by itself, with the session."""
        network = f"127.20{SIDES[side]}.{os.getpid() % 250 + 1}."
        path = os.path.join(self.folder, side)
        return Launched("demo.launch", "session:=" + path, f"bag:={path}.bag", "ns:=" + side, "rviz:=false",
                        "diagnosis:=false", f"radar_frame:={side}_radar", f"camera_frame:={side}_camera",
                        "average_frames:=20", f"host_ip:={network}1", f"card_ip:={network}2", **more)

    def test_each_is_compared_with_its_own_twin(self):
        with self.launched("left") as left:
            left.wait_for_nodes({"/left/driver"})
            with self.launched("right", port=left.port) as right:
                for launched in (left, right):
                    wait_for(lambda process=launched.process: process.poll() is not None, launched.text)
                    self.assertIn("the session has been played", launched.text())
                    for words in ("contradicts", "has died", "FATAL"):
                        self.assertNotIn(words, launched.text())
        for side, frames in FRAMES.items():
            with rosbag.Bag(os.path.join(self.folder, side + ".bag")) as bag:
                messages = [(topic, message) for topic, message, _ in bag.read_messages()]
            cubes = [m for topic, m in messages if topic.endswith("radar/adc")]
            self.assertEqual(len(cubes), frames)
            self.assertEqual({m.header.frame_id for m in cubes}, {side + "_radar"})
            ledgers = [m for topic, m in messages if topic.endswith("attribution/ledger")]
            self.assertEqual((ledgers[-1].poses, ledgers[-1].header.frame_id), (1, side + "_radar"))
            self.assertGreater(ledgers[-1].recall, 0)


if __name__ == "__main__":
    unittest.main()
