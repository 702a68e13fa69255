#!/usr/bin/env python3
"""Pictures of rviz as live, replay, inspect and demo show it, on a virtual screen: LAYOUT.png in a folder.

A small session is made for it. live needs root, as rig:=emulated does; without it that picture is left out."""
import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time

import rosgraph

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.virtual_screen import VirtualScreen

WIDTH_PX, HEIGHT_PX = 1920, 1080
COMPARED = 60  # pairs of maps that are waited for
DRAWN_S = 3    # rviz draws what it has
PORT = 11712


def run(*command):
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def picture(file, *launch):
    """Starts a launch file on a screen and keeps what is on it when some maps have been compared."""
    screen = VirtualScreen(WIDTH_PX, HEIGHT_PX)
    environment = dict(screen.environment, ROS_MASTER_URI=f"http://127.0.0.1:{PORT}", ROS_IP="127.0.0.1")
    log = file + ".log"
    with open(log, "w", encoding="utf-8") as text:
        launched = subprocess.Popen(["roslaunch", "-p", str(PORT), "mmradartwin_launch", *launch], env=environment,
                                    stdout=text, stderr=subprocess.STDOUT, start_new_session=True)
    try:
        while not rosgraph.is_master_online(environment["ROS_MASTER_URI"]):
            if launched.poll() is not None:
                sys.exit(f"error: {' '.join(launch)} has ended; see {log}")
            time.sleep(0.2)
        count = str(COMPARED if launch[0] != "inspect.launch" else 2)
        subprocess.run(["rostopic", "echo", "-n", count, "/attribution/residuals/pose"], env=environment, check=True,
                       timeout=300, stdout=subprocess.DEVNULL)
        time.sleep(DRAWN_S)
        print(screen.picture(file), flush=True)
    finally:
        launched.send_signal(signal.SIGINT)
        try:
            launched.wait(60)
        except subprocess.TimeoutExpired:
            os.killpg(launched.pid, signal.SIGKILL)
        screen.close()
    os.remove(log)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("output", help="folder of the pictures")
    parser.add_argument("--layouts", nargs="+", default=["live", "replay", "inspect", "demo"],
                        choices=["live", "replay", "inspect", "demo"])
    arguments = parser.parse_args()
    os.makedirs(arguments.output, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        session, bag, report = (os.path.join(folder, name) for name in ("session", "lab.bag", "report"))
        run(find_program("mmradartwin_tests", "make_session.py"), "--output", session, "--locations", "4",
            "--headings", "1", "--frames", "150", "--seed", "3", "--effect", "element_pattern")
        run(find_program("mmradartwin_dsp", "session_to_bag"), session, bag)
        run(find_program("mmradartwin_attribution", "evaluate"), session, "--output", report, "--quiet")
        launches = {"live": ["live.launch", "rig:=emulated", "session:=" + session, "diagnosis:=false"],
                    "replay": ["replay.launch", "bag:=" + bag, "diagnosis:=false"],
                    "inspect": ["inspect.launch", "results:=" + report],
                    "demo": ["demo.launch", "session:=" + session, "bag:=none", "diagnosis:=false"]}
        for name in arguments.layouts:
            if name == "live" and os.geteuid() != 0:
                print("live: left out, it needs root", file=sys.stderr)
                continue
            picture(os.path.join(os.path.abspath(arguments.output), name + ".png"), *launches[name])
    return 0


if __name__ == "__main__":
    sys.exit(main())
