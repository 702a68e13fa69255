#!/usr/bin/env python3
"""Driver and signal chain in one nodelet manager: frames go from one to the other without being copied."""
import os
import shutil
import subprocess
import tempfile
import unittest

from mmradartwin_tests.installed_programs import find_program
from made_session import make_session
from test_launch_files import Launched, end
from wait_for import wait_for

FRAMES = 60
PLAYER = find_program("mmradartwin_driver", "session_player")
NETWORK = f"127.201.{os.getpid() % 250 + 1}."  # of this process alone, beside others that test
LAUNCH = """
<launch>
  <node name="manager" pkg="nodelet" type="nodelet" args="manager" output="screen" />
  <node name="driver" pkg="nodelet" type="nodelet" args="load mmradartwin_driver/DriverNodelet manager" output="screen">
    <param name="radar" value="{session}/radar.yaml" type="str" />
    <param name="host_ip" value="{network}1" type="str" />
    <param name="card_ip" value="{network}2" type="str" />
  </node>
  <node name="signal_chain" pkg="nodelet" type="nodelet" args="load mmradartwin_dsp/SignalChainNodelet manager" />
  <node name="listener" pkg="rosbag" type="record" args="--quiet -O {folder}/grids.bag /radar/grid" />
</launch>
"""


class Nodelets(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="mmradartwin_nodelets_")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.session = os.path.join(self.folder, "session")
        make_session(self.session, 1, FRAMES, "--duplicates", "0")

    def test_frames_are_handed_over_and_not_copied(self):
        file = os.path.join(self.folder, "nodelets.launch")
        with open(file, "w", encoding="ascii") as out:
            out.write(LAUNCH.format(session=self.session, folder=self.folder, network=NETWORK))
        with Launched(file, package=None) as launched:
            bus = lambda: launched.bus("/manager")
            connected = lambda: bus()[1].get("/radar/adc") and bus()[0].get("/radar/grid")
            wait_for(connected, lambda: f"connections, {bus()}\n{launched.text()[-3000:]}")
            log = os.path.join(self.folder, "player.log")
            with open(log, "w", encoding="utf-8") as said:
                player = subprocess.Popen([PLAYER, "_session:=" + self.session, f"_host_ip:={NETWORK}1",
                                           f"_card_ip:={NETWORK}2"], stdout=said, stderr=subprocess.STDOUT,
                                          env=dict(launched.environment, ROSCONSOLE_STDOUT_LINE_BUFFERED="1"))
            self.addCleanup(end, player)

            def text():
                with open(log, encoding="utf-8") as file:
                    return file.read()

            wait_for(lambda: "has been played" in text() or player.poll() is not None, lambda: f"its end: {text()}")
            # It was not told to exit, and stays, so that its latched messages do: who comes now gets them.
            launched.record({"/radar/config": 1}, os.path.join(self.folder, "later.bag"))
            self.assertIsNone(player.poll(), text())
            sent, received = bus()
        # Nothing was serialised on the way: the counters of bytes say so, and count what goes to another process.
        (in_bytes, frames), = received["/radar/adc"]
        self.assertGreater(frames, FRAMES // 2)
        self.assertEqual(in_bytes, 0, received)
        self.assertEqual(sum(sent["/radar/adc"]), 0, sent)
        self.assertGreater(sum(sent["/radar/grid"]), FRAMES // 2 * 8 * 64 * 16)  # complex128 of every channel's samples


class BadParameters(unittest.TestCase):
    def test_nodelets_say_once_what_is_wrong_and_are_not_loaded(self):
        launch = """<launch>
          <node name="manager" pkg="nodelet" type="nodelet" args="manager" output="screen" />
          <node name="{name}" pkg="nodelet" type="nodelet" args="load {kind} manager" output="screen">
            <param name="{parameter}" value="{value}" />
          </node>
        </launch>"""
        for name, kind, parameter, value in (
                ("driver", "mmradartwin_driver/DriverNodelet", "radar", "/nowhere/radar.yaml"),
                ("signal_chain", "mmradartwin_dsp/SignalChainNodelet", "average_frames", "0")):
            with self.subTest(name=name), tempfile.NamedTemporaryFile("w", suffix=".launch") as file:
                file.write(launch.format(name=name, kind=kind, parameter=parameter, value=value))
                file.flush()
                with Launched(file.name, package=None) as launched:
                    launched.wait_for_text(f"[{name}-2] process has died")
                    said = [line for line in launched.text().split("\n") if "FATAL" in line and f"/{name}/{parameter}" in line]
                    self.assertEqual(len(said), 1, launched.text())
                    self.assertIn("/manager", launched.state()[1])


if __name__ == "__main__":
    unittest.main()
