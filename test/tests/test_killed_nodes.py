#!/usr/bin/env python3
"""kill -9 of each node of a running demo: who misses its messages says so and names it, and it comes back.

With MMRADARTWIN_LONG each node is killed twenty times more, at drawn times, as it starts, too.
"""
import functools
import os
import random
import shutil
import signal
import tempfile
import time
import unittest

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from mmradartwin_msgs.msg import Residuals

from chosen_sessions import RUN
from made_session import make_session
from test_launch_files import Launched
from wait_for import wait_for

# Node: (its program, the diagnostics in which its silence is told, the node that these send one to).
CASES = {"signal_chain": ("dsp_node", ("attribution: attribution", "twin: twin"), "look at the signal chain"),
         "twin": ("twin_node", ("attribution: attribution",), "look at the twin"),
         "driver": ("driver_node", ("signal_chain: signal chain", "diagnosis: diagnosis"), "look at the driver"),
         "attribution": ("attribution_node", (), ""), "diagnosis": ("diagnosis_node", (), "")}
KILLS = 20


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
        make_session(os.path.join(self.folder, "session"), 2, 15000 if RUN else 3000)
        self.said, self.residuals = [], []

    def take(self, message):
        now = time.monotonic()
        self.said += [(now, status.name.lstrip("/"), status.level, status.message) for status in message.status]

    def told(self, since, name, words):
        """When the diagnostics of that name first held the words; None where they did not."""
        return next((t for t, n, _, text in self.said if t > since and n == name and words in text), None)

    def launched(self):
        return Launched("demo.launch", "session:=" + os.path.join(self.folder, "session"), "rviz:=false",
                      "card_ip:=127.77.5.2", "host_ip:=127.77.5.1", "average_frames:=5")

    def listen(self, launched):
        """Until residuals come; one test of a run can, for a process has one node of rospy."""
        os.environ.update({key: launched.environment[key] for key in ("ROS_MASTER_URI", "ROS_IP")})
        rospy.init_node("killed_nodes_test", disable_signals=True)
        for subscriber in (rospy.Subscriber("/diagnostics", DiagnosticArray, self.take, queue_size=100),
                           rospy.Subscriber("attribution/residuals", Residuals, self.residuals.append, queue_size=100)):
            self.addCleanup(subscriber.unregister)
        wait_for(lambda: self.residuals, lambda: "residuals:\n" + launched.text()[-3000:])

    def test_silence_is_said_and_what_was_killed_comes_back(self):
        with self.launched() as launched:
            self.listen(launched)
            for node, (program, listeners, words) in CASES.items():
                with self.subTest(node=node):
                    self.kill_and_watch(launched, node, program, listeners, words)
            if RUN:
                self.kill_at_any_time(launched)
            self.assertIsNone(launched.process.poll(), launched.text()[-3000:])

    def kill_at_any_time(self, launched):
        """Nodes in a drawn order, up to 5 s after the last one is there again: now and then it is not up yet."""
        chance = random.Random(17)
        order = list(CASES) * KILLS
        chance.shuffle(order)
        before = launched.text().count("was ended by SIGKILL")
        for number, node in enumerate(order):
            program = CASES[node][0]
            pid = wait_for(functools.partial(process_of, program, node), node)
            time.sleep(chance.uniform(0, 5))
            os.kill(pid, signal.SIGKILL)
            wait_for(lambda pid=pid, node=node, program=program: process_of(program, node) not in (None, pid),
                     f"{node} again, kill {number}")
            if number % 10 == 9:
                count = len(self.residuals)
                wait_for(lambda count=count: len(self.residuals) > count + 20,
                         lambda number=number: f"residuals after {number + 1} kills:\n{launched.text()[-3000:]}")
        self.assertEqual(launched.text().count("was ended by SIGKILL") - before, len(order))
        for listener in sorted({name for _, names, _ in CASES.values() for name in names}):
            wait_for(lambda listener=listener: self.latest(listener)[2] != DiagnosticStatus.ERROR,
                     lambda listener=listener: f"{listener} stays at {self.latest(listener)}")
        print(f"{len(order)} kills at drawn times: {len(self.residuals)} residuals came, all is well again")

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
