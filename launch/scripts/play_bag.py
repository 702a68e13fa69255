#!/usr/bin/env python3
"""rosbag play for a launch file: it says in one line what is wrong with the bag, and when the bag is over.

usage: play_bag.py [--folder FOLDER] BAG [BAG ...] [-- ROSBAG_PLAY_OPTIONS...]

  --folder  relative BAGs are seen from here; else from the folder in which this runs

The node is that of rosbag play: it publishes what the bags hold, and /clock. Its service ~pause_playback
(std_srvs/SetBool) pauses and goes on.
"""
import os
import re
import signal
import subprocess
import sys

import rospkg
from roslib.packages import find_node

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import ros_master

# What rosbag play says of its progress, again and again.
PROGRESS = re.compile(r"\[(\w+) *\] .*Duration: (-?[0-9.]+) / ([0-9.]+)")


def say(level, text):
    print(f"[{level}] {text}", flush=True)


class Player:
    def __init__(self, bags, options):
        self.bags = bags
        self.command = [*find_node("rosbag", "play")[:1], *bags, *options]  # --topics takes all that follows
        self.stays, self.paused = "--keep-alive" in options, "--pause" in options
        self.child, self.stopping = None, False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self.stop)

    def stop(self, number, _):
        self.stopping = True
        if self.child and self.child.poll() is None:
            self.child.send_signal(number)

    def run(self):
        over = False
        if self.paused:
            say(" INFO", "the bag is paused; go on with: rosservice call "
                         f"{self.node()}/pause_playback \"data: false\"")
        with subprocess.Popen(self.command, stdout=subprocess.PIPE, stdin=subprocess.DEVNULL) as self.child:
            for line in self.lines():
                progress = PROGRESS.search(line)
                if not progress:
                    if line.strip() and "Hit space" not in line and "Opening" not in line:
                        say(" INFO", line.strip())
                elif not over and self.stays and float(progress[2]) >= float(progress[3]):
                    over = True
                    say(" INFO", "the bag is over; a diagnosis is possible now (rosrun mmradartwin_attribution "
                                 "request_diagnosis); Ctrl-C ends")
        if self.child.returncode and not self.stopping:
            say("FATAL", f"{', '.join(self.bags)}: rosbag play has ended with status {self.child.returncode}, for the reason "
                         "above")
        return 0 if self.stopping else self.child.returncode

    def node(self):
        names = [word.split(":=")[1] for word in sys.argv if word.startswith("__name:=")]
        return names[0] if names else "play_*"

    def lines(self):
        """Lines of the child, which ends most of them with a carriage return alone."""
        text = ""
        while True:
            part = os.read(self.child.stdout.fileno(), 4096).decode(errors="replace")
            if not part:
                return
            *whole, text = re.split(r"[\r\n]", text + part)
            yield from whole


def main():
    arguments = sys.argv[1:]
    if "--help" in arguments or "-h" in arguments:
        print(__doc__)
        return 0
    if "--version" in arguments:
        print("play_bag.py", rospkg.RosPack().get_manifest("mmradartwin_launch").version)
        return 0
    folder = os.getcwd()
    if arguments[:1] == ["--folder"] and len(arguments) > 1:
        folder, arguments = arguments[1] or folder, arguments[2:]
    if arguments[:1] and arguments[0].startswith("--") and arguments[0] != "--":
        say("FATAL", f"{arguments[0]} is not known here; rosbag's options stand behind --")
        return 2
    options = [word for word in arguments if ":=" in word]  # of ROS
    arguments = [word for word in arguments if ":=" not in word]
    if "--" in arguments:
        end = arguments.index("--")
        options += arguments[end + 1:]
        arguments = arguments[:end]
    bags = [os.path.normpath(os.path.join(folder, bag)) for bag in arguments]
    if not bags:
        say("FATAL", "no bag is given: bag:=FILE")
        return 2
    for bag in bags:
        if not os.path.isfile(bag):
            hint = ""
            if os.path.basename(bag) == "results.bag" and os.path.isdir(os.path.dirname(bag)):
                hint = "; evaluate writes it unless it was told --no-bag: evaluate again without that"
            elif os.path.exists(bag + ".active"):
                hint = f"; {bag}.active is: its recording has not ended (rosbag reindex makes it readable)"
            say("FATAL", f"{bag}: is no file{hint}")
            return 2
    missing = ros_master.problem()
    if missing:
        say("FATAL", missing)
        return 2
    return Player(bags, options).run()


if __name__ == "__main__":
    sys.exit(main())
