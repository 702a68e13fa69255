#!/usr/bin/env python3
"""record.launch on a disk that runs full: what is said, what is kept, and how it goes on."""
import glob
import os
import shutil
import signal
import subprocess
import tempfile
import unittest

import numpy
import rosbag

from mmradartwin_tests.installed_programs import find_program
from made_session import make_session
from test_emulated_rig import Rig
from test_launch_files import Launched

FRAMES = 60
RECORDER = find_program("mmradartwin_launch", "recorder.py")
VALIDATE = find_program("mmradartwin_dsp", "validate")


class Recording(Launched):
    """record.launch beside a running rig."""

    def __init__(self, rig, *arguments):
        os.environ["ROSCONSOLE_STDOUT_LINE_BUFFERED"] = "1"
        super().__init__("record.launch", *arguments, port=rig.port)

    def wait_for_frames(self, count=2 * FRAMES):
        """Returns once the open bag has so many frames, more than rosbag holds in a chunk, and what makes it whole."""
        self.wait_for_messages("/recorder", {"/radar/adc": count, "/radar/config": 1, "/twin/scene": 1, "/tf": 1,
                                             "/tf_static": 1})


class Disk:
    """A tmpfs of a few MB, and a file by which others fill it."""

    def __init__(self, test, folder, megabytes):
        self.folder, self.filler = folder, os.path.join(folder, "of_others")
        os.mkdir(folder)
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", folder], check=False,
                                 capture_output=True, text=True)
        if mounted.returncode != 0:
            test.skipTest("no disk that can be filled: mount says " + mounted.stderr.strip())
        test.addCleanup(subprocess.run, ["umount", "-l", folder], check=False)

    def fill(self, leave_bytes):
        """Leaves so many bytes free."""
        with open(self.filler, "wb", buffering=0) as file:
            while True:
                disk = os.statvfs(self.folder)
                more = disk.f_bavail * disk.f_frsize - leave_bytes
                if more <= 0:
                    return
                try:
                    file.write(b"x" * min(more, 1 << 20))
                except OSError:
                    return

    def clear(self):
        os.remove(self.filler)

    def bags(self, ending):
        return sorted(glob.glob(os.path.join(self.folder, "*" + ending)))


@unittest.skipUnless(os.geteuid() == 0, "an emulated card's network, and a disk to fill, need root")
class FullDisk(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="mmradartwin_disk_")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.disk = Disk(self, os.path.join(self.folder, "disk"), 48)
        self.session = os.path.join(self.folder, "session")
        make_session(self.session, 1, FRAMES, "--duplicates", "0")

    def test_recording_stops_says_so_goes_on_and_loses_nothing_of_what_it_had(self):
        with Rig(self.folder, self.session, None, "diagnosis:=false") as rig:
            rig.wait_for_text("samples arrive", 1, 240)
            with Recording(rig, "output:=" + os.path.join(self.disk.folder, "run"), "min_free:=8M") as recording:
                recording.wait_for_frames()
                self.assertEqual(len(self.disk.bags(".active")), 1, recording.text()[-2000:])

                # Others leave less than min_free: the bag is closed while there is room for its index.
                self.disk.fill(4 << 20)
                recording.wait_for_text("is full")
                self.assertEqual(len(self.disk.bags(".bag")), 1, recording.text()[-2000:])
                self.assertEqual(self.disk.bags(".active"), [])
                self.disk.clear()
                recording.wait_for_text("recording goes on in a new bag")
                recording.wait_for_frames()
                self.assertEqual(len(self.disk.bags(".active")), 1, recording.text()[-2000:])

                # Nothing is left from one moment to the next: rosbag cannot close its bag any more.
                self.disk.fill(0)
                recording.wait_for_text("is full", 2)
                self.disk.clear()
                recording.wait_for_text("recording goes on in a new bag", 2)
                whole = len(self.disk.bags(".bag"))
                recording.wait_for_frames()
                self.assertEqual(len(self.disk.bags(".active") + self.disk.bags(".bag")), 3, recording.text()[-2000:])
                recording.process.send_signal(signal.SIGINT)
                self.assertEqual(recording.process.wait(60), 0)
                text = recording.text()
            self.assertNotIn("has died", rig.text())
            runs = rig.runs()
        bags = self.disk.bags(".bag")
        self.assertGreater(len(bags), whole)
        for bag in self.disk.bags(".bag.active"):
            self.assertIn(f"rosbag reindex {bag}", text)
            self.assertIn("rosbag reindex", subprocess.run([VALIDATE, bag], capture_output=True, text=True,
                                                           check=False).stderr)
            subprocess.run(["rosbag", "reindex", "--quiet", bag], check=True, capture_output=True, timeout=120)
            bags.append(bag)
        self.assertEqual(len(bags), 3)
        self.check_frames(bags, runs)

    def check_frames(self, bags, runs):
        """Every bag stands alone; every frame in it is the one that its number and stamp say, and none is missing."""
        raw = numpy.fromfile(glob.glob(os.path.join(self.session, "captures", "*.bin"))[0], "<i2")
        content = [frame.tobytes() for frame in raw.reshape(-1, 2, 64, 2, 4).transpose(0, 1, 2, 4, 3)]
        (start_ns, first), = runs  # the radar was never started anew
        for file in bags:
            with rosbag.Bag(file) as bag:
                frames = [m for _, m, _ in bag.read_messages(["/radar/adc", "radar/adc"])]
                topics = {topic.lstrip("/") for topic in bag.get_type_and_topic_info().topics}
            self.assertTrue({"radar/config", "tf", "tf_static", "twin/scene"} <= topics, f"{file}: {topics}")
            self.assertGreater(len(frames), 20, file)
            numbers = [m.sequence for m in frames]
            self.assertEqual(numbers, list(range(numbers[0], numbers[0] + len(numbers))), file)
            for m in frames:
                self.assertEqual(m.lost_bytes, 0)
                self.assertEqual(numpy.array(m.samples, "<i2").tobytes(), content[(first + m.sequence) % FRAMES])
                late_s = (m.header.stamp.to_nsec() - start_ns) * 1e-9 - m.sequence * 0.05
                self.assertLess(abs(late_s), 0.25)


class Use(unittest.TestCase):
    def test_bad_use_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            for arguments, words in ((("--min-free", "lots", "--output-prefix", folder + "/a"), "must be a size"),
                                     (("--min-free", "0", "--output-prefix", folder + "/a"), "must be a size"),
                                     (("--min-free", "1M", "--output-prefix", folder + "/none/a"), "is no folder"),
                                     (("--output-prefix", folder + "/a"), "usage:")):
                run = subprocess.run([RECORDER, *arguments], capture_output=True, text=True, timeout=60, check=False)
                self.assertEqual(run.returncode, 2, run.stdout + run.stderr)
                self.assertIn(words, run.stdout + run.stderr)


if __name__ == "__main__":
    unittest.main()
