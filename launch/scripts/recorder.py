#!/usr/bin/env python3
"""rosbag record that a full disk does not surprise: it looks at the free space twice a second (rosbag itself every
20 s), closes the bag while there is room for its index, says so, and begins a new one when there is room again.

usage: recorder.py --min-free SIZE [--folder FOLDER] --output-prefix PREFIX [ROSBAG_RECORD_ARGUMENTS...]

  SIZE      as in 500M, 2G
  FOLDER    a relative PREFIX is seen from here; else from the folder in which this runs
  PREFIX    of the bags' names; date and time follow
"""
import argparse
import glob
import os
import re
import signal
import subprocess
import sys
import time

import rospkg
from roslib.packages import find_node

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import ros_master

UNITS = {"": 1, "k": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40}
LOOK_EVERY_S = 0.5
# New recordings begin with so many times the least free space: else a bag would follow the other every second.
ROOM = 2


def say(text, error=False):
    print(("[ERROR] " if error else "[ INFO] ") + text, flush=True)


def bytes_of(size):
    """Bytes of "500M"; exits with status 2 for what is no size."""
    match = re.fullmatch(r"(\d+)([kMGT]?)", size)
    if not match or int(match[1]) == 0:
        say(f"min_free: '{size}' must be a size such as 500M or 2G", error=True)
        sys.exit(2)
    return int(match[1]) * UNITS[match[2]]


def text_of(count):
    """"1.5 GB" for people."""
    for unit, factor in (("GB", 1 << 30), ("MB", 1 << 20)):
        if count >= factor:
            return f"{count / factor:.1f} {unit}"
    return f"{count / 1024:.0f} kB"


class Recorder:
    """One recording, of as many bags as the disk makes necessary."""

    def __init__(self, min_free, prefix, arguments):
        self.min_free_bytes = bytes_of(min_free)
        self.prefix = prefix
        self.folder = os.path.dirname(self.prefix)
        self.record_program = find_node("rosbag", "record")[:1]
        self.command = [*self.record_program, "--output-prefix", self.prefix, "--min-space", min_free, *arguments]
        self.child, self.stopping, self.known, self.told = None, False, set(), set()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self.stop)

    def stop(self, *_):
        self.stopping = True
        if self.child and self.child.poll() is None:
            self.child.send_signal(signal.SIGINT)

    def free_bytes(self):
        disk = os.statvfs(self.folder)
        return disk.f_bavail * disk.f_frsize

    def bags(self):
        """Bags of this recording that were not there at the last look."""
        fresh = set(glob.glob(glob.escape(self.prefix) + "*.bag*")) - self.known
        self.known |= fresh
        return sorted(fresh)

    def tell_bags(self):
        """Says each bag's name once, as replay.launch takes it."""
        for path in sorted(glob.glob(glob.escape(self.prefix) + "*.bag*")):
            bag = path[:-len(".active")] if path.endswith(".active") else path
            if bag not in self.told and bag not in self.known and path not in self.known:
                self.told.add(bag)
                say(f"recording to {bag} (later: roslaunch mmradartwin_launch replay.launch bag:={bag})")

    def record(self):
        """One run of rosbag record. Returns its exit status, and whether the disk ended it."""
        with subprocess.Popen(self.command) as self.child:
            full = False
            if self.stopping:
                self.child.send_signal(signal.SIGINT)
            while self.child.poll() is None:
                self.tell_bags()
                if not full and self.free_bytes() < self.min_free_bytes:
                    full = True
                    self.child.send_signal(signal.SIGINT)
                try:
                    self.child.wait(LOOK_EVERY_S)
                except subprocess.TimeoutExpired:
                    pass
        self.tell_bags()
        return self.child.returncode, full or (self.child.returncode != 0 and self.free_bytes() < self.min_free_bytes)

    def wait_for_room(self):
        while not self.stopping and self.free_bytes() < ROOM * self.min_free_bytes:
            time.sleep(LOOK_EVERY_S)

    def run(self):
        """Exit status: 0 stopped by its user, 2 bad use, 1 what rosbag could not do."""
        if not os.path.isdir(self.folder):
            say(f"{self.folder}: is no folder; give output:= with a folder that exists", error=True)
            return 2
        missing = ros_master.problem()
        if missing:
            say(missing, error=True)
            return 2
        if not self.record_program:
            say("rosbag's record is not here; install rosbag", error=True)
            return 2
        self.bags()
        while not self.stopping:
            if self.free_bytes() < self.min_free_bytes:
                say(f"nothing is recorded yet: {text_of(self.free_bytes())} are free in {self.folder}, and min_free is "
                    f"{text_of(self.min_free_bytes)}; recording begins by itself with "
                    f"{text_of(ROOM * self.min_free_bytes)}: make room, or record to another disk", error=True)
                self.wait_for_room()
                continue
            status, full = self.record()
            if not full:
                if status != 0 and not self.stopping:
                    say(f"rosbag record has ended with status {status}: what it said stands above", error=True)
                return 0 if status == 0 or self.stopping else 1
            self.tell_full_disk()
            self.wait_for_room()
            if not self.stopping:
                say("there is room again: recording goes on in a new bag; frames in between are not recorded")
        return 0

    def tell_full_disk(self):
        bags = self.bags()
        whole = [bag for bag in bags if bag.endswith(".bag")]
        cut = [bag for bag in bags if bag.endswith(".active")]
        say(f"the disk of {self.folder} is full ({text_of(self.free_bytes())} free, min_free is "
            f"{text_of(self.min_free_bytes)}): recording has stopped" +
            (f"; whole and closed: {', '.join(whole)}" if whole else "") +
            ". It goes on by itself, in a new bag, when "
            f"{text_of(ROOM * self.min_free_bytes)} are free: make room, or record to another disk", error=True)
        for bag in cut:
            say(f"{bag}: was cut off by the full disk; with as much room as it takes, `rosbag reindex {bag}` makes it "
                "readable up to there", error=True)


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1].split("\n")[0], description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False)
    parser.add_argument("--min-free", required=True, metavar="SIZE", help=argparse.SUPPRESS)
    parser.add_argument("--folder", default="", help=argparse.SUPPRESS)
    parser.add_argument("--output-prefix", required=True, metavar="PREFIX", help=argparse.SUPPRESS)
    parser.add_argument("--version", action="version",
                        version="recorder.py " + rospkg.RosPack().get_manifest("mmradartwin_launch").version)
    options, arguments = parser.parse_known_args()
    if not options.output_prefix:
        say("output: is empty; give the beginning of the bags' names", error=True)
        return 2
    prefix = os.path.normpath(os.path.join(options.folder or os.getcwd(), options.output_prefix))
    return Recorder(options.min_free, prefix, arguments).run()


if __name__ == "__main__":
    sys.exit(main())
