#!/usr/bin/env python3
"""Starts live, replay, inspect and record as a user would (demo has a test of its own) and looks at what runs and flows."""
import glob
import os
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import unittest
import xmlrpc.client

import numpy
import rosbag
import rosgraph
import rospkg
import yaml

from mmradartwin_tests.installed_programs import find_program
from wait_for import PATIENCE_S, wait_for


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def end(process, seconds=60):
    """Ends a process as by Ctrl-C, so that what it started ends with it: a killed roscore leaves its rosmaster."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def start_master(environment):
    """A rosmaster at the environment's ROS_MASTER_URI, that answers."""
    uri = environment["ROS_MASTER_URI"]
    master = subprocess.Popen(["rosmaster", "--core", "-p", uri.rsplit(":", 1)[1]], env=environment,
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    wait_for(lambda: rosgraph.is_master_online(uri) or master.poll() is not None, "an answer of the rosmaster")
    return master


def same_pose(a, b):
    """True where two geometry_msgs/Pose differ by rounding alone."""
    dot = sum(getattr(a.orientation, k) * getattr(b.orientation, k) for k in "xyzw")
    return all(abs(getattr(a.position, k) - getattr(b.position, k)) < 1e-9 for k in "xyz") and abs(dot) > 1 - 1e-12


class Launched:
    """One roslaunch on a master of its own, ended with SIGINT as by Ctrl-C. Without a package, of a file by its path."""

    def __init__(self, *arguments, port=None, package="mmradartwin_launch"):
        self.port = port or free_port()
        self.environment = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{self.port}", ROS_IP="127.0.0.1")
        self.log = tempfile.NamedTemporaryFile("w+", prefix="mmradartwin_launch_", suffix=".log")
        # roslaunch gives a master that it starts itself ten seconds, which a busy machine may need more of.
        self.master = None if port else start_master(self.environment)
        self.process = subprocess.Popen(["roslaunch", "-p", str(self.port), *filter(None, [package]), *arguments],
                                        env=self.environment, stdout=self.log, stderr=subprocess.STDOUT,
                                        stdin=subprocess.DEVNULL, start_new_session=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(30)
            except subprocess.TimeoutExpired:
                os.killpg(self.process.pid, signal.SIGKILL)
        if self.master:
            end(self.master)
        self.log.close()

    def text(self):
        with open(self.log.name) as file:
            return file.read()

    def state(self):
        """(publishers by topic, nodes)."""
        try:
            publishers, subscribers, _ = rosgraph.Master("/test", self.environment["ROS_MASTER_URI"]).getSystemState()
        except (OSError, rosgraph.MasterException):
            return {}, set()
        nodes = {node for _, names in publishers + subscribers for node in names}
        return {topic: names for topic, names in publishers}, nodes

    def wait_for_nodes(self, wanted, seconds=PATIENCE_S):
        """All nodes, once the wanted ones are among them."""
        return wait_for(lambda: (nodes := self.state()[1]) >= wanted and nodes,
                        lambda: f"nodes {wanted - self.state()[1]} are missing:\n{self.text()[-2000:]}", seconds)

    def wait_for_text(self, text, count=1, seconds=PATIENCE_S):
        """Returns once the launch has said the text so many times; AssertionError where it ends before."""
        wait_for(lambda: self.text().count(text) >= count or self.process.poll() is not None,
                 lambda: f"\"{text}\" {count} times:\n{self.text()[-4000:]}", seconds)
        if self.text().count(text) < count:
            raise AssertionError(f"it ended and had not said \"{text}\" {count} times:\n{self.text()[-4000:]}")

    def wait_for_messages(self, node, counts, seconds=PATIENCE_S):
        """Returns once the node has had so many messages, {topic: count}, from one publisher of each topic."""
        def arrived():
            received = self.bus(node)[1]
            return all(any(n >= count for _, n in received.get(topic, [])) for topic, count in counts.items())

        wait_for(arrived, lambda: f"{counts} at {node}, which has had {self.bus(node)[1]}:\n{self.text()[-2000:]}",
                 seconds)

    def bus(self, node):
        """Of a roscpp node: {topic: [bytes sent over a connection]}, {topic: [(bytes, messages) received over one]}."""
        try:
            uri = rosgraph.Master("/test", self.environment["ROS_MASTER_URI"]).lookupNode(node)
            with xmlrpc.client.ServerProxy(uri) as proxy:
                sent, received = proxy.getBusStats("/test")[:2]  # as roscpp answers: without code and message
        except (OSError, rosgraph.MasterException, rosgraph.MasterError):
            return {}, {}
        return ({topic: [c[1] for c in connections] for topic, connections in sent},
                {topic: [tuple(c[1:3]) for c in connections] for topic, connections in received})

    def record(self, counts, file, more=()):
        """Records topics, and more that may be silent, until so many messages have come, {topic: count}.

        Returns message counts by topic."""
        recorder = subprocess.Popen(["rosbag", "record", "--quiet", "-O", file, *counts, *more, "__name:=counting"],
                                    env=self.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            self.wait_for_messages("/counting", counts)
        finally:
            subprocess.run(["rosnode", "kill", "/counting"], env=self.environment, stdout=subprocess.DEVNULL,
                           timeout=120, check=False)
            recorder.wait(120)
        with rosbag.Bag(file) as bag:
            return {topic: info.message_count for topic, info in bag.get_type_and_topic_info().topics.items()}


class LaunchFiles(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="mmradartwin_launch_")
        session = os.path.join(cls.folder, "session")
        cls.bag = os.path.join(cls.folder, "session.bag")
        cls.results = os.path.join(cls.folder, "report")
        for command in ([find_program("mmradartwin_tests", "make_session.py"), "--output", session, "--locations", "2",
                         "--headings", "1", "--frames", "100", "--pause", "1", "--seed", "21"],
                        [find_program("mmradartwin_dsp", "session_to_bag"), session, cls.bag],
                        [find_program("mmradartwin_attribution", "evaluate"), session, "--output", cls.results]):
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=600)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    def path(self, name):
        return os.path.join(self.folder, name)

    def test_nodes_say_why_they_do_not_start(self):
        port = free_port()
        environment = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1",
                           ROSCONSOLE_STDOUT_LINE_BUFFERED="1")
        self.addCleanup(end, start_master(environment))
        for package, program, argument, words in (
                ("mmradartwin_dsp", "dsp_node", "_average_frames:=0", "average_frames"),
                ("mmradartwin_driver", "driver_node", "_radar:=/nowhere/radar.yaml", "/nowhere/radar.yaml"),
                ("mmradartwin_driver", "session_player", "_session:=/nowhere", "/nowhere"),
                ("mmradartwin_sim", "twin_node", "_rate_hz:=-1", "rate_hz"),
                ("mmradartwin_sim", "room_pose", "_scene:=/nowhere/scene.yaml", "/nowhere/scene.yaml"),
                ("mmradartwin_attribution", "attribution_node", "_markers_hz:=-1", "markers_hz")):
            run = subprocess.run([find_program(package, program), argument], env=environment, capture_output=True,
                                 text=True, timeout=120, check=False)
            self.assertEqual(run.returncode, 2, msg=f"{program}: {run.stdout}{run.stderr}")
            self.assertIn("FATAL", run.stdout + run.stderr, msg=program)
            self.assertIn(words, run.stdout + run.stderr, msg=program)

    def test_live_starts_and_stays_without_a_card(self):
        with Launched("live.launch", "rviz:=false", "card_ip:=127.77.1.2", "host_ip:=127.77.1.1") as launched:
            nodes = launched.wait_for_nodes({"/driver", "/signal_chain", "/twin", "/attribution", "/diagnosis"})
            launched.wait_for_text("no answer from the DCA1000 at 127.77.1.2")
            # Twice a second from most nodes: they go on after that.
            launched.record({"/diagnostics": 40}, self.path("without_card.bag"))
            self.assertNotIn("has died", launched.text())
            self.assertLessEqual(nodes, launched.state()[1])
        with rosbag.Bag(self.path("without_card.bag")) as bag:
            said = {status.name: status.message for _, message, _ in bag.read_messages() for status in message.status}
        self.assertIn("nothing comes on /radar/adc", said["signal_chain: signal chain"])
        self.assertIn("look at the driver", said["signal_chain: signal chain"])
        self.assertIn("look at the signal chain", said["attribution: attribution"])
        # Each has one place among the groups for diagnostic_aggregator.
        with open(os.path.join(rospkg.RosPack().get_path("mmradartwin_config"), "diagnostic_aggregator.yaml"),
                  encoding="ascii") as file:
            groups = yaml.safe_load(file)["analyzers"].values()
        for name in said:
            self.assertEqual(sum(any(part in name for part in group["contains"]) for group in groups), 1, name)

    def test_replay_runs_the_chain_on_the_bags_clock_without_the_driver(self):
        with Launched("replay.launch", "bag:=" + self.bag, "rviz:=false", "rate:=0.5") as launched:
            nodes = launched.wait_for_nodes({"/player", "/signal_chain", "/twin", "/attribution", "/diagnosis"})
            self.assertNotIn("/driver", nodes)
            sim_time = rosgraph.Master("/test", launched.environment["ROS_MASTER_URI"]).getParam("/use_sim_time")
            self.assertTrue(sim_time)
            counts = launched.record({"/attribution/residuals": 45, "/twin/paths": 1, "/twin/grid": 1, "/radar/config": 1,
                                      "/radar/range_angle": 45}, self.path("replayed.bag"))
            self.assertGreater(counts.get("/radar/range_angle", 0), 40)
            self.assertGreater(counts.get("/attribution/residuals", 0), 40)
            # Nothing is stamped with the wall clock: stamps lie within the bag's.
            with rosbag.Bag(self.bag) as bag:
                first, last = bag.get_start_time(), bag.get_end_time()
            with rosbag.Bag(self.path("replayed.bag")) as bag:
                for _, message, _ in bag.read_messages("/radar/range_angle"):
                    self.assertTrue(first - 1 <= message.header.stamp.to_sec() <= last + 1)

        with rosbag.Bag(self.path("replayed.bag")) as bag:
            radar = next(message for _, message, _ in bag.read_messages("/radar/config"))
            paths = [message for _, message, _ in bag.read_messages("/twin/paths")]
            grids = [message for _, message, _ in bag.read_messages("/twin/grid")]
        self.check_records(radar, paths, grids)

    def check_records(self, radar, paths, grids):
        """The published grid is the sum of its records and sum|c|^2 = M A^2, within 1e-6 (contracts, section 4)."""
        samples, rate = radar.samples_per_chirp, radar.sample_rate_hz
        from_center_s = numpy.arange(samples) / rate - samples / (2 * rate)
        compared = 0
        for message in paths:
            grid = next((g for g in grids if same_pose(g.T_map_radar, message.T_map_radar)), None)
            if grid is None:
                continue
            amplitude = numpy.array([r.amplitude for r in message.records])
            c = numpy.array([numpy.array(r.c_re) + 1j * numpy.array(r.c_im) for r in message.records])
            length_m = numpy.array([r.length_m for r in message.records])
            numpy.testing.assert_allclose((numpy.abs(c) ** 2).sum(1), grid.channels * amplitude ** 2, rtol=1e-6)
            turns = radar.slope_hz_per_s * length_m[:, :, None] / 299792458.0 * from_center_s
            rebuilt = (c[:, :, None] * numpy.exp(2j * numpy.pi * turns)).sum(0)
            published = numpy.array(grid.data).view(complex).reshape(grid.channels, grid.samples)
            self.assertLess(numpy.linalg.norm(published - rebuilt), 1e-6 * numpy.linalg.norm(rebuilt))
            compared += 1
        self.assertGreater(compared, 0)

    def test_stored_results_last_two_seconds_a_pose(self):
        with rosbag.Bag(os.path.join(self.results, "results.bag")) as bag:
            poses = bag.get_message_count("attribution/residuals")
            self.assertGreater(poses, 1)
            self.assertAlmostEqual(bag.get_end_time() - bag.get_start_time(), 2 * poses, delta=0.01)

    def test_inspect_shows_stored_results(self):
        with Launched("inspect.launch", "results:=" + self.results, "rviz:=false") as launched:
            nodes = launched.wait_for_nodes({"/inspect"})
            self.assertFalse({"/driver", "/signal_chain", "/twin"} & nodes)
            counts = launched.record({"/attribution/markers": 1, "/attribution/residuals": 1}, self.path("inspected.bag"))
            self.assertGreater(counts.get("/attribution/markers", 0), 0)
            self.check_help_of_inspect(launched)

    def check_help_of_inspect(self, launched):
        """The node has the topics and services of its help."""
        text = subprocess.run([find_program("mmradartwin_attribution", "inspect_node"), "--help"], check=True,
                              capture_output=True, text=True, timeout=120).stdout
        told = {title: set(re.findall(r"^  (\S+) \(", part, re.M)) for title, part in
                re.findall(r"^(Subscribes|Publishes|Services):\n((?:  .*\n)*)", text, re.M)}
        graph = rosgraph.Master("/test", launched.environment["ROS_MASTER_URI"]).getSystemState()
        for title, entries, more in zip(("Publishes", "Subscribes", "Services"), graph,
                                        ({"rosout"}, set(), {"inspect/get_loggers", "inspect/set_logger_level"})):
            names = {name.lstrip("/") for name, nodes in entries if "/inspect" in nodes}
            self.assertEqual(names, {name.lstrip("/") for name in told[title]} | more, title)

    def test_a_pose_is_shown_on_request(self):
        with Launched("inspect.launch", "results:=" + self.results, "rviz:=false", "pause:=true") as launched:
            launched.wait_for_nodes({"/inspect"})
            with rosbag.Bag(os.path.join(self.results, "results.bag")) as bag:
                poses = next(m for _, m, _ in bag.read_messages("inspect/poses")).poses

            def call(request):
                run = subprocess.run(["rosservice", "call", "/inspect/show", request], env=launched.environment,
                                     capture_output=True, text=True, timeout=120, check=False)
                return run.stdout

            wait_for(lambda: "success: True" in call("{order: residual_rms_db, pose: first, step: 0}"), "an answer")
            launched.record({"/attribution/pose": 1, "/attribution/residuals": 1, "/inspect/shown": 1},
                            self.path("worst.bag"))
            with rosbag.Bag(self.path("worst.bag")) as bag:
                shown = {topic: message for topic, message, _ in bag.read_messages()}
            worst = max(poses, key=lambda pose: pose.residual_rms_db)
            self.assertEqual(shown["/attribution/pose"].name, worst.name)
            self.assertEqual(shown["/attribution/residuals"].pose, worst.name)
            self.assertEqual((shown["/inspect/shown"].rank, shown["/inspect/shown"].name), (0, worst.name))
            self.assertIn("success: False", call("{order: '', pose: nowhere, step: 0}"))
            self.assertIn("beauty", call("{order: beauty, pose: '', step: 0}"))

    def test_record_writes_bags_that_stand_alone(self):
        with Launched("replay.launch", "bag:=" + self.bag, "rviz:=false", "rate:=0.3", "diagnosis:=false") as replay:
            replay.wait_for_nodes({"/player"})
            with Launched("record.launch", "output:=" + self.path("recorded"), "results:=true", "split_mb:=1",
                          "min_free:=1M", port=replay.port) as recorder:
                recorder.wait_for_nodes({"/recorder"})
                wait_for(lambda: len(glob.glob(self.path("recorded*.bag"))) >= 4,
                         lambda: f"four bags: {os.listdir(self.folder)}")
        bags = sorted(glob.glob(self.path("recorded*.bag")))
        self.assertGreater(len(bags), 3, os.listdir(self.folder))
        recorded, latched = set(), {"radar/config", "session", "twin/scene"}
        for file in bags:
            with rosbag.Bag(file) as bag:  # which keeps topics as they were asked for
                topics = {topic.lstrip("/") for topic in bag.get_type_and_topic_info().topics}
            self.assertLessEqual(latched & recorded, topics, f"{file}: not repeated")
            recorded |= topics
        self.assertTrue(latched | {"radar/adc", "radar/grid", "tf"} <= recorded, recorded)


if __name__ == "__main__":
    unittest.main()
