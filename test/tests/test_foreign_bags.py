#!/usr/bin/env python3
"""Bags as other people record them, through every program that takes one: read rightly, or refused with the cause."""
import os
import shutil
import subprocess
import unittest

import geometry_msgs.msg
import mmradartwin_msgs.msg
import rosbag
import rospy
import tf2_msgs.msg

from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.moving_bag import config_message
from mmradartwin_tests.radar import Radar
from in_folder import InFolder

PROGRAMS = {name: find_program(package, name)
            for package, names in {"mmradartwin_dsp": ("process", "validate", "bag_to_session", "session_to_bag"),
                                   "mmradartwin_sim": ("simulate",),
                                   "mmradartwin_attribution": ("diagnose", "evaluate", "calibrate")}.items()
            for name in names}
START_S, STAND_S, PERIOD_S = 1_700_000_000, 3.0, 0.05


def time_of(t):
    """Zero where t is None."""
    return rospy.Time() if t is None else rospy.Time.from_sec(START_S) + rospy.Duration.from_sec(t)


def transform(parent, child, x, t=None):
    message = geometry_msgs.msg.TransformStamped()
    message.header.stamp, message.header.frame_id, message.child_frame_id = time_of(t), parent, child
    message.transform.translation.x, message.transform.rotation.w = x, 1.0
    return tf2_msgs.msg.TFMessage([message])


def place(t):
    """A cart that stands at 0 m, is pushed to 1 m, and stands there."""
    return min(max(t - STAND_S, 0.0), 1.0)


class Writer:
    """Messages with the names of their publishers, into one bag or, by their time, into parts of one."""

    def __init__(self, files, part_s=1e9):
        # Small chunks: what stands in a chunk that was begun is lost with a recorder that is cut off.
        self.bags, self.part_s = [rosbag.Bag(file, "w", chunk_threshold=50_000) for file in files], part_s
        self.connections = {}

    def write(self, topic, t, message, publisher):
        header = {"callerid": publisher, "topic": topic, "type": message._type, "md5sum": message._md5sum,
                  "message_definition": message._full_text}
        part = min(len(self.bags) - 1, int(max(t, 0) / self.part_s))
        # A recorder keeps a connection for each publisher; rosbag in Python keeps one for each topic.
        known, key = self.bags[part]._topic_connections, (part, topic, publisher)
        known.pop(topic, None)
        if key in self.connections:
            known[topic] = self.connections[key]
        self.bags[part].write(topic, message, time_of(t), connection_header=header)
        self.connections[key] = known[topic]

    def close(self):
        for bag in self.bags:
            bag.close()


def record(writer, namespaces=("",), frame_stamp=lambda t: t, tf_stamp=lambda t: t, also=lambda writer, t: None):
    """Two stands of a cart with a point target 4 m ahead of the first."""
    radar = Radar()
    config, radar_hash = config_message(radar)
    for i, ns in enumerate(namespaces):
        writer.write(ns + "/radar/config", 0, config, "/radar_driver")
        writer.write("/tf_static", 0, transform("cart", "radar_link" + (f"_{i}" if i else ""), 0.1), "/mount")
    for i in range(int((2 * STAND_S + 1) / PERIOD_S)):
        t = i * PERIOD_S
        writer.write("/tf", t, transform("map", "cart", place(t), tf_stamp(t)), "/slam")
        also(writer, t)
        length_m = 2 * (4.0 - place(t))
        grid = radar.grid([[length_m] * radar.channels], [2000.0])
        for k, ns in enumerate(namespaces):
            cube = mmradartwin_msgs.msg.AdcCube(radar_hash=radar_hash, sequence=i, chirps=2,
                                                samples_per_chirp=radar.samples, receivers=4)
            cube.header.stamp = time_of(frame_stamp(t + 0.001))
            cube.header.frame_id = "radar_link" + (f"_{k}" if k else "")
            by_chirp = grid.reshape(2, 4, radar.samples).transpose(0, 2, 1)     # [chirp][sample][rx]
            cube.samples = [round(v) for c in by_chirp.ravel() for v in (c.real, c.imag)]
            cube.chirp_valid = bytes([1, 1])
            writer.write(ns + "/radar/adc", t + 0.055, cube, "/radar_driver")


@unittest.skipIf(None in PROGRAMS.values(), "the programs are not built in this workspace")
class ForeignBags(InFolder):
    def bag(self, name, **options):
        writer = Writer([self.at(name)])
        record(writer, **options)
        writer.close()
        return self.at(name)

    def run_program(self, name, *arguments):
        return subprocess.run([PROGRAMS[name], *arguments], capture_output=True, text=True, check=False)

    def commands(self, bags, *options):
        """Every program that reads a bag, with a fresh folder to write to."""
        for name in ("process", "diagnose", "evaluate", "calibrate", "bag_to_session"):
            output = self.at("out", name)
            shutil.rmtree(output, ignore_errors=True)
            os.makedirs(self.at("out"), exist_ok=True)
            if name == "bag_to_session":
                yield name, [*bags, output, *options]
            else:
                more = ["--reflector", "4", "0", "0"] if name == "calibrate" else []
                yield name, [*bags, "--output", output, *more, *options]

    def assert_refused(self, bags, *words):
        """Each program says it in one line; validate finds it."""
        for name, arguments in self.commands(bags):
            with self.subTest(program=name, bags=bags):
                run = self.run_program(name, *arguments)
                errors = [line for line in run.stderr.splitlines() if line.startswith("error: ")]
                self.assertEqual((run.returncode, len(errors)), (2, 1), msg=run.stderr)
                for word in words:
                    self.assertIn(word, errors[0])
        run = self.run_program("validate", *bags)
        self.assertEqual(run.returncode, 2, msg=run.stderr)
        for word in words:
            self.assertIn(word, run.stdout + run.stderr)

    def assert_read(self, bags, *options, name="process"):
        """Two poses; returns what the program says on stderr."""
        arguments = dict(self.commands(bags, *options))[name]
        run = self.run_program(name, *arguments)
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        if name == "process":
            self.assertEqual(len(os.listdir(self.at("out", "process", "maps"))), 2, msg=run.stderr)
        return run.stderr

    def test_a_bag_that_was_cut_off_is_read_once_it_has_an_index(self):
        writer = Writer([self.at("lab.bag")])
        record(writer)
        for bag in writer.bags:
            bag.flush()
        shutil.copy(self.at("lab.bag"), self.at("cut.bag.active"))
        writer.close()
        cut = self.at("cut.bag.active")
        self.assert_refused([cut], "no index", f"rosbag reindex {cut}")
        subprocess.run(["rosbag", "reindex", cut], check=True, capture_output=True)
        for name in ("process", "diagnose", "bag_to_session"):
            self.assert_read([cut], name=name)
        shutil.copy(self.at("lab.bag"), self.at("LAB.BAG"))
        self.assert_read([self.at("LAB.BAG")])

    def test_a_program_of_sessions_says_how_a_bag_becomes_one(self):
        run = self.run_program("session_to_bag", self.bag("lab.bag"), self.at("b.bag"))
        self.assertEqual(run.returncode, 2)
        self.assertEqual(run.stderr.count("\n"), 1, msg=run.stderr)
        self.assertIn("bag_to_session", run.stderr)

    def test_parts_of_a_split_bag(self):
        parts = [self.at(f"lab_{i}.bag") for i in range(3)]
        writer = Writer(parts, part_s=2.5)
        record(writer)
        writer.close()
        self.assert_refused(parts[1:2], "part 1", "latched", parts[0])
        for name in ("process", "diagnose", "bag_to_session"):
            self.assert_read([parts[2], parts[0], parts[1]], name=name)
        self.assertEqual(self.run_program("validate", *parts).returncode, 0)

    def test_one_of_two_radars(self):
        bag = self.bag("two.bag", namespaces=("/left", "/right"))
        for name, arguments in self.commands([bag]):
            with self.subTest(program=name):
                run = self.run_program(name, *arguments)
                self.assertEqual(run.returncode, 2, msg=run.stderr)
                self.assertIn("--radar /left or --radar /right", run.stderr)
        for ns in ("/left", "right"):
            for name in ("process", "diagnose", "bag_to_session"):
                self.assert_read([bag], "--radar", ns, name=name)

    def test_clocks_of_two_computers(self):
        bag = self.bag("clocks.bag", frame_stamp=lambda t: t + 112.0)
        self.assert_refused([bag], "s later", "clocks", "--clock-offset 11", "/slam")
        for name in ("process", "diagnose", "bag_to_session"):
            self.assert_read([bag], "--clock-offset", "112", name=name)

    def test_stamps_that_tell_no_time(self):
        self.assert_refused([self.bag("zero.bag", frame_stamp=lambda t: None)], "/radar/adc", "all zero", "did not stamp")
        self.assert_refused([self.bag("same.bag", frame_stamp=lambda t: 2.0)], "/radar/adc", "all the same")

    def test_transforms_that_contradict_each_other(self):
        def odometry(writer, t):
            writer.write("/tf", t + 0.01, transform("odom", "cart", place(t), t + 0.01), "/ekf")

        def mount(writer, t):
            if t == 0:
                writer.write("/tf_static", 0.01, transform("cart", "radar_link", 0.6), "/old_mount")

        self.assert_refused([self.bag("odom.bag", also=odometry)], "cart has 2 parents", "map (published by /slam)",
                            "odom (published by /ekf)")
        self.assert_refused([self.bag("mounts.bag", also=mount)], "two static transforms of cart -> radar_link", "0.500 m",
                            "/mount)", "/old_mount)")

    def test_warnings_of_tf2_are_one_line(self):
        def again(writer, t):
            writer.write("/tf", t, transform("map", "cart", place(t), t), "/slam")

        bag = self.bag("again.bag", also=again)
        for name in ("process", "diagnose"):
            said = self.assert_read([bag], name=name)
            lines = [line for line in said.splitlines() if "TF_REPEATED_DATA" in line]
            self.assertEqual(len(lines), 1, msg=said)
            self.assertIn("note: ", lines[0])
            self.assertIn("tf2 left out 140 transform(s)", lines[0])


if __name__ == "__main__":
    unittest.main()
