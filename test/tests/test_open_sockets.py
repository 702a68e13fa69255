#!/usr/bin/env python3
"""What a launch listens on: with ROS_IP on loopback no socket of any of its processes can be reached from elsewhere."""
import os
import shutil
import subprocess
import tempfile
import unittest

import rosgraph

from made_session import make_session
from mmradartwin_tests.installed_programs import find_program
from test_launch_files import Launched, end, free_port
from wait_for import wait_for


def children(pid):
    """The process and all that it and its children started."""
    found, parents = {pid}, {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                with open(f"/proc/{entry}/stat", encoding="ascii", errors="replace") as file:
                    parents[int(entry)] = int(file.read().rsplit(")", 1)[1].split()[1])
            except OSError:
                pass
    while grown := {child for child, parent in parents.items() if parent in found} - found:
        found |= grown
    return found


def sockets_of(pids):
    """[(program, address)] of TCP that listens and UDP that is bound, whoever may reach it."""
    lines = subprocess.run(["ss", "-Hlntup"], capture_output=True, text=True, check=True, timeout=60).stdout.split("\n")
    return [(line.split('"')[1], line.split()[4]) for line in lines if any(f"pid={pid}," in line for pid in pids)]


class OpenSockets(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="mmradartwin_open_")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.session = os.path.join(self.folder, "session")
        make_session(self.session, 1, 1200)

    def listens(self, launch, *arguments):
        port = free_port()
        uri = f"http://127.0.0.1:{port}"
        # With rosout, in the environment of demo.sh.
        core = subprocess.Popen(["roscore", "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                env=dict(os.environ, ROS_MASTER_URI=uri, ROS_IP="127.0.0.1",
                                         LD_PRELOAD="libmmradartwin_dsp_loopback_only.so"))
        self.addCleanup(end, core)
        wait_for(lambda: rosgraph.is_master_online(uri), "roscore's answer")
        with Launched(launch, "rviz:=false", *arguments, port=port) as launched:
            nodes = {"/driver", "/signal_chain", "/twin", "/attribution", "/diagnosis", "/rosout"}
            if launch != "demo.launch":
                nodes = nodes - {"/driver"} | {"/player"}
            launched.wait_for_nodes(nodes)
            def seen():
                found = sockets_of(children(launched.process.pid) | children(core.pid))
                return len(found) > 2 * len(nodes) and found

            found = wait_for(seen, lambda: f"sockets of all nodes:\n{launched.text()[-2000:]}")
            self.assertNotIn("cannot be preloaded", launched.text())
        self.assertLessEqual({"rosmaster", "rosout", "dsp_node"}, {program for program, _ in found})
        return [(program, address) for program, address in found
                if not address.startswith(("127.", "[::1]", "[::ffff:127."))]

    def test_a_demo_on_loopback_listens_nowhere_else(self):
        self.assertEqual(self.listens("demo.launch", "session:=" + self.session, "card_ip:=127.77.6.2",
                                      "host_ip:=127.77.6.1"), [])

    def test_a_replay_on_loopback_listens_nowhere_else(self):
        bag = os.path.join(self.folder, "session.bag")
        subprocess.run([find_program("mmradartwin_dsp", "session_to_bag"), self.session, bag], check=True, timeout=600,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.assertEqual(self.listens("replay.launch", "bag:=" + bag), [])


if __name__ == "__main__":
    unittest.main()
