#!/usr/bin/env python3
"""live.launch rig:=emulated as a user starts it, and what happens to rigs: cables, power, a restarted roscore."""
import bisect
import functools
import glob
import os
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import unittest

import numpy
import rosbag
import rosgraph

from made_session import make_session
from test_launch_files import Launched, end, free_port
from wait_for import wait_for

POSES, FRAMES, PERIOD_S = 2, 60, 0.05
RECORD = "/usr/lib/rosbag/record"  # itself: the Python front end takes long to start on a busy machine


def processes(*parts):
    """Ids of the processes whose command line holds all of these."""
    found = []
    for path in glob.glob("/proc/[0-9]*/cmdline"):
        try:
            with open(path, "rb") as file:
                line = file.read().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue
        if all(part in line for part in parts):
            found.append(int(path.split("/")[2]))
    return found


class Rig(Launched):
    """live.launch on an emulated rig with names and addresses of its own."""

    def __init__(self, folder, session, port, *more):
        self.folder, self.session = folder, session
        self.interface = f"mmrt{os.getpid() % 100000}"
        os.environ["ROS_HOME"] = os.path.join(folder, "ros")
        os.environ["ROSCONSOLE_STDOUT_LINE_BUFFERED"] = "1"
        network = f"10.77.{os.getpid() % 250 + 1}."
        super().__init__("live.launch", "rig:=emulated", "session:=" + session, "rviz:=false", "average_frames:=20",
                         "host_ip:=" + network + "1", "card_ip:=" + network + "2",
                         "rig_options:=--interface " + self.interface, *more, port=port)

    def text(self):
        return re.sub(r"\x1b\[[0-9;]*m", "", super().text())

    def do(self, command):
        """A command to the emulated rig."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as s:
            s.sendto(command.encode(), os.path.join(self.folder, "ros", "emulated_rig", "control"))

    def network_is_there(self):
        return os.path.exists("/sys/class/net/" + self.interface)

    def played(self):
        """(poses, frames) of the session that the emulator plays: without repeated poses."""
        return tuple(map(int, re.search(r"ready poses=(\d+) frames=(\d+)", self.text()).groups()))

    def runs(self):
        """[(ns of the first frame's start, session frame)] of the radar's runs, from the emulator's own account."""
        return [(int(a), int(b)) for a, b in re.findall(r"frames run first_frame_ns=(\d+) frame=(\d+)", self.text())]


def wait_for_recorded(words, bag):
    """Returns once text that matches the words has been written to an open bag, which is not compressed."""
    before = os.path.getsize(bag)

    def written():
        with open(bag, "rb") as file:
            file.seek(before)
            return re.search(words.encode(), file.read())

    wait_for(written, f"\"{words}\" in {bag}")


@unittest.skipUnless(os.geteuid() == 0, "an emulated card's network needs root")
class EmulatedRig(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="mmradartwin_rig_")
        cls.session = os.path.join(cls.folder, "session")
        make_session(cls.session, POSES, FRAMES)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    def path(self, name):
        return os.path.join(self.folder, name)

    def core(self, port):
        """A roscore of its own, that answers."""
        uri = f"http://127.0.0.1:{port}"
        core = subprocess.Popen(["roscore", "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                env=dict(os.environ, ROS_MASTER_URI=uri, ROS_IP="127.0.0.1"))
        self.addCleanup(end, core)
        wait_for(lambda: rosgraph.is_master_online(uri), "roscore's answer")
        return core

    def recorder(self, rig, bag, *topics):
        return subprocess.Popen([RECORD, "--quiet", "-O", self.path(bag), *topics, f"__name:={bag.split('.')[0]}"],
                                env=rig.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def stop(self, process, number=signal.SIGINT):
        process.send_signal(number)
        process.wait(60)

    def test_faults_are_named_and_overcome_and_no_frame_is_mislabelled(self):
        # A disk for the recording of packets that soon comes to the 1 GiB that the recorder leaves free.
        disk = self.path("disk")
        os.mkdir(disk)
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1049576k", "tmpfs", disk], check=True)
        self.addCleanup(subprocess.run, ["umount", "-l", disk])
        port = free_port()
        core = self.core(port)
        with Rig(self.folder, self.session, port, "record_pcap:=" + os.path.join(disk, "packets.pcap")) as rig:
            rig.wait_for_text("samples arrive", 1, 240)
            recorder = self.recorder(rig, "faults.bag", "/radar/adc", "/radar/config", "/diagnostics", "/tf",
                                     "/tf_static", "/twin/grid", "/attribution/residuals")
            self.addCleanup(lambda: recorder.poll() is None and recorder.kill())
            rig.wait_for_messages("/faults", {"/radar/adc": 2 * FRAMES, "/diagnostics": 1, "/twin/grid": 1,
                                              "/attribution/residuals": 1})
            heard = functools.partial(wait_for_recorded, bag=self.path("faults.bag.active"))

            rig.do("usb out")
            rig.wait_for_text("the device is gone")
            heard("device is gone|is not there")
            rig.do("usb in")
            rig.wait_for_text("samples arrive", 2)

            rig.do("cable out")
            rig.wait_for_text("no answer from the DCA1000", rig.text().count("no answer from the DCA1000") + 1)
            heard("no answer from the DCA1000")
            rig.do("cable in")
            rig.wait_for_text("samples arrive", 3)

            rig.do("card off")
            rig.wait_for_text("no answer from the DCA1000", rig.text().count("no answer from the DCA1000") + 1)
            heard("no answer from the DCA1000")
            rig.do("card on")
            rig.wait_for_text("samples arrive", 4)

            # It is put in at once: frames that pass while it is out are counted by nobody.
            rig.do("ribbon out")
            rig.wait_for_text("no samples come from the card")
            rig.do("ribbon in")
            rig.wait_for_text("samples arrive", 5)

            rig.do("event 1003")
            player, = processes("session_player", self.session, "__name:=emulated_rig")
            os.kill(player, signal.SIGSTOP)
            heard(r"[0-9.]+ s old")
            os.kill(player, signal.SIGCONT)
            heard("poses were missing for")
            # Faults may have left too few packets so far to fill the disk.
            rig.wait_for_text("are free on its disk")
            heard("missing from the recording")
            rig.wait_for_messages("/faults", {"/radar/adc": 8 * FRAMES})

            self.stop(core)
            rig.wait_for_text("the ROS master is gone")
            core = self.core(port)
            rig.wait_for_text("registered anew", 4)
            later = self.recorder(rig, "later.bag", "/radar/adc", "/radar/config")
            self.addCleanup(lambda: later.poll() is None and later.kill())
            rig.wait_for_messages("/later", {"/radar/adc": FRAMES, "/radar/config": 1})
            self.stop(later)
            self.stop(recorder)
            text, runs, played = rig.text(), rig.runs(), rig.played()
        end(core)
        wait_for(lambda: not processes("rosmaster", str(port)), "the end of the rosmaster", 60)
        self.assertNotIn("error: radar:", text)  # no violation of its protocol, as the emulated chip sees it
        wait_for(lambda: not rig.network_is_there(), "the end of the emulated network", 60)
        self.assertGreaterEqual(len(runs), 5)
        self.check_diagnostics()
        self.check_frames(runs, *played)
        with rosbag.Bag(self.path("later.bag")) as bag:
            counts = {topic: info.message_count for topic, info in bag.get_type_and_topic_info().topics.items()}
        self.assertGreater(counts.get("/radar/adc", 0), 10, "who comes after the restart finds no frames")
        self.assertEqual(counts.get("/radar/config", 0), 1)

    def check_diagnostics(self):
        said, values = set(), {}
        with rosbag.Bag(self.path("faults.bag")) as bag:
            for _, message, _ in bag.read_messages("/diagnostics"):
                said |= {(status.name.split(": ")[-1], status.level, status.message) for status in message.status}
                for status in message.status:
                    for value in status.values:
                        values.setdefault((status.name.split(": ")[-1], value.key), set()).add(value.value)
            config = next(message for _, message, _ in bag.read_messages("/radar/config"))
            topics = bag.get_type_and_topic_info().topics
        self.assertGreater(topics["/twin/grid"].message_count, 0)
        self.assertGreater(topics["/attribution/residuals"].message_count, 0)
        # 1553 steps of 3.6e6 * 900 / 2^26 kHz/us: what the chip can do next to 75 MHz/us.
        self.assertAlmostEqual(config.slope_hz_per_s, 1553 * 3.6e6 * 900 / 2 ** 26 * 1e9, delta=1e3)
        # Diagnostics come once a second: of two that follow each other at once either may be the one that is seen.
        for task, level, part in (("radar stream", 0, "streaming"), ("radar device", 0, "frames run"),
                                  ("radar device", 2, "device is gone|is not there"),
                                  ("radar stream", 2, "no answer from the DCA1000"),
                                  ("radar stream", 2, "no samples for"), ("radar pose", 1, "jumped by"),
                                  ("radar pose", 2, "s old"), ("radar pose", 1, "poses were missing for"),
                                  ("radar stream", 1, "missing from the recording")):
            self.assertTrue(any(task == t and level == v and any(p in m for p in part.split("|")) for t, v, m in said),
                            f"{task} never said \"{part}\" at level {level}: {sorted(said)}")
        self.assertTrue(any(t == "radar device" and v > 0 and "event: " in m for t, v, m in said), sorted(said))
        self.assertIn("45", values["radar device", "temperature at calibration [deg C]"])  # the emulated chip's
        self.assertIn("FPGA 2.8", values["capture card", "card version"])
        self.assertTrue(any(abs(float(v) - 1 / PERIOD_S) < 2 for v in values["radar stream", "frame rate [Hz]"]))
        self.assertTrue(any(int(v) > 0 for v in values["radar stream", "lost bytes"]))  # the cable was out
        for task, key in (("radar stream", "packets dropped by this host"), ("capture card", "last card status"),
                          ("radar pose", "age [s]"), ("radar device", "events")):
            self.assertIn((task, key), values)

    def check_frames(self, runs, played_poses, total):
        """Every whole frame is one of the session's, counted from a start of the radar and stamped with its time."""
        with open(os.path.join(self.session, "poses.csv")) as file:
            rows = [line.strip().split(",") for line in file][1:played_poses + 1]
        names = [row[0] for row in rows]
        content = {}
        for pose, name in enumerate(names):
            raw = numpy.fromfile(os.path.join(self.session, "captures", name + ".bin"), "<i2")
            for i, frame in enumerate(raw.reshape(-1, 2, 64, 2, 4).transpose(0, 1, 2, 4, 3)):
                content[frame.tobytes()] = pose * FRAMES + i
        self.assertEqual(len(content), total)
        whole, poses = 0, []
        with rosbag.Bag(self.path("faults.bag")) as bag:
            for _, message, _ in bag.read_messages("/radar/adc"):
                if message.lost_bytes:
                    continue
                whole += 1
                frame = content.get(numpy.array(message.samples, "<i2").tobytes())
                self.assertIsNotNone(frame, f"frame {message.sequence} is none of the session's")
                stamp_ns = message.header.stamp.to_nsec()
                late_s = [(stamp_ns - start) * 1e-9 - message.sequence * PERIOD_S for start, first in runs
                          if (first + message.sequence) % total == frame]
                # A quarter second: what a busy machine may send a packet late; a frame of another run is seconds off.
                self.assertTrue(late_s and min(map(abs, late_s)) < 0.25,
                                f"frame {message.sequence}, the session's {frame}, at {stamp_ns}: {late_s}; runs {runs}")
                poses.append((stamp_ns, frame // FRAMES))
            transforms = sorted(((t.header.stamp.to_nsec(), t.transform.translation)
                                 for _, message, _ in bag.read_messages("/tf")
                                 for t in message.transforms if t.child_frame_id == "camera_link"), key=lambda t: t[0])
        self.assertGreater(whole, 200)
        # Where poses come without a gap, that of a frame is the one that its samples were measured at.
        stamps = [stamp for stamp, _ in transforms]
        checked = 0
        for stamp_ns, pose in poses:
            at = bisect.bisect_right(stamps, stamp_ns)
            if not 0 < at < len(stamps) or stamps[at] - stamps[at - 1] > 0.2e9:
                continue
            near = [transforms[at - 1][1], transforms[at][1]]
            x, y = (float(v) for v in rows[pose][3:5])
            if all(abs(t.x - near[0].x) < 1e-6 for t in near):  # not on the way from one pose to the next
                self.assertLess(abs(near[0].x - x) + abs(near[0].y - y), 1e-3)
                checked += 1
        self.assertGreater(checked, 100)

    def test_nothing_is_left_where_it_is_killed(self):
        with Rig(self.folder, self.session, None) as rig:
            wait_for(rig.network_is_there, lambda: f"the emulated network:\n{rig.text()[-2000:]}")
            # As a machine that runs out of memory would.
            for pid in processes("emulated_rig", self.session):
                os.kill(pid, signal.SIGKILL)
            wait_for(lambda: not rig.network_is_there(), "the end of the emulated network", 60)


if __name__ == "__main__":
    unittest.main()
