#!/usr/bin/env python3
"""A roslaunch launch-prefix that says what a node's end means for the launch.

usage: supervise.py [--restart] [--end-launch] COMMAND...

  --restart     a COMMAND that a signal ended (a crash) is started again after 2 s
  --end-launch  where COMMAND ends well, roslaunch ends as by Ctrl-C; without it the other nodes go on

A COMMAND that ends with another status than 0, as nodes do for a file that is not there or a bad parameter, ends the
launch: it has said why, and would say the same again.
"""
import os
import signal
import subprocess
import sys
import time

import rospkg

RESTART_AFTER_S = 2
PATIENCE_S = 30  # of a node that waits for roslaunch to end it


def version():
    return rospkg.RosPack().get_manifest("mmradartwin_launch").version


def say(level, text):
    print(f"[{level}] {text}", file=sys.stderr, flush=True)


class Supervisor:
    def __init__(self, command, restart, end_launch):
        self.command, self.restart, self.end_launch = command, restart, end_launch
        self.child, self.stopping = None, False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self.stop)

    def stop(self, number, _):
        """roslaunch signals the whole group of processes; whoever signals this one alone means the node, too."""
        self.stopping = True
        if self.child and self.child.poll() is None:
            self.child.send_signal(number)

    def name(self):
        """Of the node, as roslaunch calls it."""
        names = [word.split(":=")[1] for word in self.command if word.startswith("__name:=")]
        return names[0] if names else os.path.basename(self.command[0])

    def run(self):
        while not self.stopping:
            try:
                with subprocess.Popen(self.command) as self.child:
                    status = self.child.wait()
            except OSError as error:
                say("FATAL", f"{self.command[0]}: cannot be started ({error.strerror})")
                self.end_roslaunch()
                return 2
            if self.stopping or status >= 0 or not self.restart:
                break
            say("ERROR", f"{self.name()} was ended by {signal.Signals(-status).name}: it is started again in "
                         f"{RESTART_AFTER_S} s")
            time.sleep(RESTART_AFTER_S)
        if self.stopping:
            return max(self.child.returncode, 0) if self.child else 0
        if status != 0:
            say("FATAL", f"{self.name()} has ended with status {status}, for the reason above: the launch ends")
        if status != 0 or self.end_launch:
            self.end_roslaunch()
        return status if status >= 0 else 128 - status

    def end_roslaunch(self):
        """Ends it as by Ctrl-C, and waits until it ends this process: else it would call its end a death."""
        with open(f"/proc/{os.getppid()}/cmdline", encoding="utf-8", errors="replace") as file:
            if "roslaunch" not in file.read():
                return
        os.kill(os.getppid(), signal.SIGINT)
        deadline = time.monotonic() + PATIENCE_S
        while not self.stopping and time.monotonic() < deadline:
            time.sleep(0.05)


def main():
    arguments, options = sys.argv[1:], set()
    while arguments and arguments[0].startswith("--"):
        options.add(arguments.pop(0))
    if "--help" in options:
        print(__doc__)
        return 0
    if "--version" in options:
        print("supervise.py", version())
        return 0
    unknown = options - {"--restart", "--end-launch"}
    if unknown or not arguments:
        say("FATAL", f"{min(unknown)} is not known" if unknown else "no COMMAND is given")
        print(__doc__, file=sys.stderr)
        return 2
    return Supervisor(arguments, "--restart" in options, "--end-launch" in options).run()


if __name__ == "__main__":
    sys.exit(main())
