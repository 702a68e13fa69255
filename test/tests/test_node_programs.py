#!/usr/bin/env python3
"""--help and --version of every node and script of the launch files: complete, and without a master."""
import os
import re
import subprocess
import unittest

import rosgraph
import rospkg

from in_folder import InFolder
from mmradartwin_tests.installed_programs import find_program
from test_launch_files import end, free_port, start_master
from wait_for import wait_for

OFFICE = "package://mmradartwin_config/office/scene.yaml"
RADAR = "package://mmradartwin_config/radar.yaml"
# What each node needs to run, with the network of the driver on this machine alone.
NODES = {
    ("mmradartwin_dsp", "dsp_node"): [],
    ("mmradartwin_sim", "twin_node"): [],
    ("mmradartwin_sim", "room_pose"): ["_scene:=" + OFFICE],
    ("mmradartwin_attribution", "attribution_node"): [],
    ("mmradartwin_attribution", "diagnosis_node"): [],
    ("mmradartwin_driver", "driver_node"): ["_radar:=" + RADAR, "_card_ip:=127.77.9.2", "_host_ip:=127.77.9.1"],
}
PLAYER = ("mmradartwin_driver", "session_player")
INSPECT = ("mmradartwin_attribution", "inspect_node")  # its graph: test_launch_files
OTHERS = [("mmradartwin_attribution", "request_diagnosis"), ("mmradartwin_driver", "with_emulated_usb"),
          ("mmradartwin_launch", "emulated_rig.sh"), ("mmradartwin_launch", "demo.sh"),
          ("mmradartwin_launch", "recorder.py"), ("mmradartwin_launch", "play_bag.py"),
          ("mmradartwin_launch", "supervise.py")]
SECTIONS = ["Subscribes", "Publishes", "Services", "Parameters"]
ENTRY = re.compile(r"  (\S+) \(([^,()]+)(?:, ([^()]*))?\): (\S.*)")


def path_of(package, name):
    """Shell scripts stand in the sources alone where nothing is installed."""
    return find_program(package, name) or os.path.join(rospkg.RosPack().get_path(package), "scripts", name)


def run(program, *arguments, uri="http://127.0.0.1:1", seconds=120):
    """With a master that never answers: whoever asks one waits for ever."""
    return subprocess.run([path_of(*program), *arguments], env=dict(os.environ, ROS_MASTER_URI=uri), check=False,
                          capture_output=True, text=True, timeout=seconds, stdin=subprocess.DEVNULL)


def sections(text):
    """{section: {name: (type, what else stands in the brackets)}} of a node's help."""
    found, section = {}, None
    for line in text.split("\n"):
        if re.fullmatch(r"[A-Z][a-z]+:", line):
            section = found.setdefault(line[:-1], {})
        elif section is not None and line.startswith("  ") and line != "  none":
            entry = ENTRY.fullmatch(line)
            if not entry:
                raise AssertionError(f"no entry: {line!r}")
            section[entry[1]] = (entry[2], entry[3] or "")
    return found


class Help(unittest.TestCase):
    def test_every_program_helps_and_tells_its_version_without_a_master(self):
        for program in [*NODES, PLAYER, INSPECT, *OTHERS]:
            with self.subTest(program=program):
                helped = run(program, "--help")
                self.assertEqual(helped.returncode, 0, helped.stdout + helped.stderr)
                self.assertIn(program[1], helped.stdout)
                version = run(program, "--version")
                self.assertEqual(version.returncode, 0, version.stdout + version.stderr)
                self.assertRegex(version.stdout, rf"\A{re.escape(program[1])} \d+\.\d+\.\d+")

    def test_nodes_have_the_same_sections_in_the_same_order(self):
        for program in [*NODES, PLAYER, INSPECT]:
            with self.subTest(program=program):
                text = run(program, "--help").stdout
                self.assertEqual(list(sections(text)), SECTIONS, text)
                for name, (kind, more) in sections(text)["Parameters"].items():
                    self.assertIn(kind, ("number", "whole number", "true or false", "text", "path"), name)
                    self.assertRegex(more, "^(default |must be given)", name)
                    self.assertTrue(kind not in ("number", "whole number") or " to " in more, name)

    def test_what_is_no_remapping_is_refused(self):
        said = run(("mmradartwin_sim", "twin_node"), "--scene", "x.yaml")
        self.assertEqual(said.returncode, 2)
        self.assertIn("--scene", said.stderr)

    def test_a_diagnosis_is_not_asked_for_without_end(self):
        said = run(("mmradartwin_attribution", "request_diagnosis"), "--wait", "1")
        self.assertEqual(said.returncode, 2)
        self.assertEqual(said.stderr.count("\n"), 1, said.stderr)
        self.assertIn("no ROS master answers", said.stderr)


class Graph(InFolder):
    def setUp(self):
        super().setUp()
        self.environment = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{free_port()}", ROS_IP="127.0.0.1",
                                ROS_HOME=self.folder, ROSCONSOLE_STDOUT_LINE_BUFFERED="1")
        self.addCleanup(end, start_master(self.environment))
        self.master = rosgraph.Master("/test", self.environment["ROS_MASTER_URI"])

    def topics_of(self, node):
        """(subscribed, published, services) of a node."""
        publishers, subscribers, services = self.master.getSystemState()
        return tuple({topic for topic, names in kind if node in names} for kind in (subscribers, publishers, services))

    def check_graph(self, program, arguments):
        """Help and master agree about the node. Each has a name of its own: a node's parameters outlive it."""
        name_of = "/looked_at_" + program[1]
        text = sections(run(program, "--help").stdout)
        full = {name: name if name[0] == "/" else name_of + "/" + name[1:] if name[0] == "~" else "/" + name
                for section in SECTIONS[:3] for name in text[section]}
        wanted = tuple({full[name] for name in text[section]} for section in SECTIONS[:3])
        of_roscpp = {name_of + "/get_loggers", name_of + "/set_logger_level"}
        with open(self.at(program[1] + ".log"), "w", encoding="utf-8") as log:
            node = subprocess.Popen([find_program(*program), *arguments, "__name:=" + name_of[1:]], stdout=log, stderr=log,
                                    env=self.environment)

        def there():
            subscribed, published, services = self.topics_of(name_of)
            return (subscribed, published - {"/rosout"}, services - of_roscpp) == wanted

        try:
            wait_for(there, lambda: f"{wanted}, but {self.topics_of(name_of)}")
            types = dict(self.master.getTopicTypes())
            for name, (kind, _) in {**text["Subscribes"], **text["Publishes"]}.items():
                self.assertIn(types[full[name]], (kind, "*"), name)
        finally:
            end(node)

    def test_topics_and_services_are_those_of_the_help(self):
        for program, arguments in NODES.items():
            with self.subTest(program=program):
                self.check_graph(program, arguments)

    def test_parameters_are_those_of_the_help(self):
        folders = {PLAYER: ["_session:=" + self.folder], INSPECT: ["_results:=" + self.folder]}
        for program, arguments in {**NODES, **folders}.items():
            with self.subTest(program=program):
                said = subprocess.run([find_program(*program), *arguments, "_no_such:=1"], env=self.environment,
                                      capture_output=True, text=True, timeout=120, check=False)
                self.assertEqual(said.returncode, 2, said.stdout + said.stderr)
                known = re.search(r"no_such: is not known; known: ([a-z_0-9, ]+)", said.stdout + said.stderr)
                self.assertTrue(known, said.stdout + said.stderr)
                self.assertEqual(set(known[1].split(", ")), set(sections(run(program, "--help").stdout)["Parameters"]))


if __name__ == "__main__":
    unittest.main()
