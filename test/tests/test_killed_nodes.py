#!/usr/bin/env python3
"""kill -9 of each node of a running demo: who misses its messages says so and names it, and it comes back."""
import os
import shutil
import signal
import tempfile
import time
import unittest

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from mmradartwin_msgs.msg import Residuals

from made_session import make_session
from test_launch_files import Launched
from wait_for import wait_for

# Node: (its program, the diagnostics in which its silence is told, the node that these send one to).
CASES = {"signal_chain": ("dsp_node", ("attribution: attribution", "twin: twin"), "look at the signal chain"),
         "twin": ("twin_node", ("attribution: attribution",), "look at the twin"),
         "driver": ("driver_node", ("signal_chain: signal chain", "diagnosis: diagnosis"), "look at the driver"),
         "attribution": ("attribution_node", (), ""), "diagnosis": ("diagnosis_node", (), "")}


def process_of(program, name):
    """Id of the node's own process, not of what started it."""
    for entry in os.listdir("/proc"):
        if not entry.isdigit():
            continue
        try:
            with open(f"/proc/{entry}/cmdline", "rb") as file:
                words = file.read().decode(errors="replace").split("\0")
        except OSError:
            continue
        if os.path.basename(words[0]) == program and "__name:=" + name in words:
            return int(entry)
    return None


class KilledNodes(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="mmradartwin_killed_")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        make_session(os.path.join(self.folder, "session"), 2, 3000)
        self.said, self.residuals = [], []

    def take(self, message):
        now = time.monotonic()
        self.said += [(now, status.name.lstrip("/"), status.level, status.message) for status in message.status]

    def told(self, since, name, words):
        """When the diagnostics of that name first held the words; None where they did not."""
        return next((t for t, n, _, text in self.said if t > since and n == name and words in text), None)

    def test_silence_is_said_and_what_was_killed_comes_back(self):
        with Launched("demo.launch", "session:=" + os.path.join(self.folder, "session"), "rviz:=false",
                      "card_ip:=127.77.5.2", "host_ip:=127.77.5.1", "average_frames:=5") as launched:
            os.environ.update({key: launched.environment[key] for key in ("ROS_MASTER_URI", "ROS_IP")})
            rospy.init_node("killed_nodes_test", disable_signals=True)
            keep = [rospy.Subscriber("/diagnostics", DiagnosticArray, self.take, queue_size=100),
                    rospy.Subscriber("attribution/residuals", Residuals, self.residuals.append, queue_size=100)]
            wait_for(lambda: self.residuals, lambda: "residuals:\n" + launched.text()[-3000:])
            for node, (program, listeners, words) in CASES.items():
                with self.subTest(node=node):
                    self.kill_and_watch(launched, node, program, listeners, words)
            self.assertIsNone(launched.process.poll(), launched.text()[-3000:])
            for subscriber in keep:
                subscriber.unregister()

    def kill_and_watch(self, launched, node, program, listeners, words):
        pid = wait_for(lambda: process_of(program, node), node)
        # A steady stream, of which nobody misses anything.
        steady = len(self.residuals)
        wait_for(lambda: len(self.residuals) > steady + 40, lambda: f"residuals before {node} is killed")
        for listener in listeners:
            wait_for(lambda listener=listener: self.latest(listener) and words not in self.latest(listener)[3],
                     lambda listener=listener: f"{listener}: {self.latest(listener)}")
        killed = time.monotonic()
        os.kill(pid, signal.SIGKILL)
        for listener in listeners:
            wait_for(lambda listener=listener: self.told(killed, listener, words),
                     lambda listener=listener: f"'{words}' of {listener}, which says {self.latest(listener)}")
            after_s = self.told(killed, listener, words) - killed
            print(f"{node} killed: {listener} says so after {after_s:.2f} s")
            self.assertLess(after_s, 3, listener)  # 2 s, and what a busy machine takes
        launched.wait_for_text(f"{node} was ended by SIGKILL")
        again = wait_for(lambda: process_of(program, node), node + " again")
        self.assertNotEqual(again, pid)
        count = len(self.residuals)
        wait_for(lambda: len(self.residuals) > count + 20, lambda: f"residuals after {node}:\n{launched.text()[-3000:]}")
        for listener in listeners:
            wait_for(lambda listener=listener: self.latest(listener)[2] != DiagnosticStatus.ERROR,
                     lambda listener=listener: f"{listener} stays at {self.latest(listener)}")
        print(f"{node} killed: all is well again after {time.monotonic() - killed:.1f} s")

    def latest(self, name):
        return next((entry for entry in reversed(self.said) if entry[1] == name), None)


if __name__ == "__main__":
    unittest.main()
