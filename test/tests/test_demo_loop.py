#!/usr/bin/env python3
"""The demo on a small session, as a user runs it: emulator, UDP, driver, tf, signal chain, twin, attribution, rviz, report."""
import base64
import collections
import csv
import html
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest

import numpy
import rosbag
import rospkg

POSES, FRAMES = 3, 60


def picture_pixels(file):
    """[height, width, 3] uint8 of a PNG."""
    header = subprocess.run(["identify", "-format", "%w %h", file], check=True, capture_output=True, text=True).stdout
    width, height = map(int, header.split())
    raw = subprocess.run(["convert", file, "-depth", "8", "rgb:-"], check=True, capture_output=True).stdout
    return numpy.frombuffer(raw, numpy.uint8).reshape(height, width, 3).astype(int)


def fan_stretches(pixels, axis):
    """Columns (axis 0) or rows (1) that hold the floor of a fan's colour map, viridis(0) = (68, 1, 84): stretches of at
    least 100 pixels."""
    floor = (numpy.abs(pixels - numpy.array([68, 1, 84])).sum(axis=2) < 24).sum(axis=axis) > 40
    edges = numpy.flatnonzero(numpy.diff(numpy.concatenate([[0], floor.astype(int), [0]])))
    return [(a, b) for a, b in zip(edges[::2], edges[1::2]) if b - a >= 100]


def rows_of(*parts):
    """Rows of a CSV file as dictionaries."""
    with open(os.path.join(*parts), encoding="utf-8") as text:
        return list(csv.DictReader(text))


def check_report(test, folder, names):
    """report.html has a row of each pose with what poses.csv and residuals.csv hold of it, and pictures of the worst."""
    with open(os.path.join(folder, "report.html"), encoding="utf-8") as file:
        page = html.unescape(file.read())
    with open(os.path.join(folder, "summary.json"), encoding="utf-8") as file:
        summary = json.load(file)
    rows = rows_of(folder, "poses.csv")
    test.assertEqual([row["pose"] for row in rows], names)
    active, recalled = (sum(int(row[column]) for row in rows) for column in ("active", "recalled"))
    test.assertGreater(active, 0)
    test.assertAlmostEqual(summary["central"]["recall"], recalled / active)
    test.assertEqual(sorted(summary["worst_first"]), names)
    explained = [float(row["explained_power"]) for row in sorted(rows, key=lambda row: summary["worst_first"].index(row["pose"]))]
    test.assertEqual(explained, sorted(explained))
    classes = collections.Counter((row["pose"], row["class"]) for row in rows_of(folder, "residuals.csv"))
    text = re.sub(r"<[^>]*>", "", page.split("All poses, the worst first")[1].replace("</td>", " "))
    for row in rows:
        counted = "/".join(str(classes[row["pose"], f"C{i}"]) for i in range(1, 6))
        test.assertEqual(counted, "/".join(row[f"c{i}"] for i in range(1, 6)), row["pose"])
        said = re.search(rf"^{row['pose']} \S+ % (\d+) of (\d+) ([\d.]+) ([\d.]+) \S+ ([\d/]+) $", text, re.MULTILINE)
        test.assertTrue(said, text[:400])
        test.assertEqual(said.group(1, 2, 5), (row["recalled"], row["active"], counted), row["pose"])
        for shown, column in zip(said.group(3, 4), ("q1_energy", "q2_energy")):
            test.assertAlmostEqual(float(shown), float(row[column]), delta=0.00051, msg=row["pose"])   # of three decimals
        picture = os.path.join(folder, "pictures", row["pose"] + ".png")
        test.assertGreaterEqual(len(fan_stretches(picture_pixels(picture), 0)), 2, row["pose"])
    pictures = re.findall(r'src="data:image/png;base64,([^"]*)"', page)
    test.assertEqual(len(pictures), 3 * min(len(names), 4) + 1, "three of each pose that is shown, and the coverage")
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        file.write(base64.b64decode(pictures[0]))
        file.flush()
        test.assertGreaterEqual(len(fan_stretches(picture_pixels(file.name), 0)), 1, "the measured fan of the worst pose")
    coverage = picture_pixels(os.path.join(folder, "coverage.png"))
    test.assertGreater(len(numpy.unique(coverage.reshape(-1, 3), axis=0)), 4, "nothing is drawn")


class DemoLoop(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.out = tempfile.mkdtemp(prefix="mmradartwin_demo_")
        script = os.path.join(rospkg.RosPack().get_path("mmradartwin_launch"), "scripts", "demo.sh")
        environment = dict(os.environ, DEMO_LOCATIONS=str(POSES), DEMO_HEADINGS="1", DEMO_FRAMES=str(FRAMES), DEMO_SEED="11")
        environment.pop("DISPLAY", None)
        cls.demo = subprocess.run([script, cls.out], env=environment, capture_output=True, text=True, timeout=1800)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.out, ignore_errors=True)

    def path(self, *parts):
        return os.path.join(self.out, *parts)

    def test_ends_with_status_zero(self):
        self.assertEqual(self.demo.returncode, 0, self.demo.stderr[-3000:])

    def test_ends_with_a_diagnosis_and_the_twin_that_it_extends(self):
        with open(self.path("diagnosis", "findings.json")) as file:
            self.assertEqual(json.load(file)["poses"]["count"], POSES)
        self.assertTrue(os.path.exists(self.path("report_extended", "report.html")))
        self.assertRegex(self.demo.stdout, r"Hidden: the antennas.*\n +element_pattern: cos_exponent [0-9.]+\nFound: +\w")

    def test_speaks_in_few_lines_and_names_a_page_that_is_there(self):
        said = self.demo.stderr + self.demo.stdout
        self.assertLessEqual(len(said.splitlines()), 40, said)
        self.assertNotIn("\033", said)
        page = re.search(r"^Open this page: +(.*)$", self.demo.stdout, re.MULTILINE).group(1)
        self.assertTrue(os.path.isfile(page), page)
        for name in ("1_generate", "2_live", "3_evaluate", "4_diagnose", "5_replay", "6_evaluate"):
            self.assertTrue(os.path.isfile(self.path("log", name + ".log")), name)

    def test_every_frame_of_the_session_came_through_udp_bit_for_bit(self):
        with open(self.path("session", "poses.csv")) as file:
            names = [line.split(",")[0] for line in file][1:]
        sent = []
        for name in names[:POSES]:
            sent.append(numpy.fromfile(self.path("session", "captures", name + ".bin"), "<i2").reshape(FRAMES, 2, 64, 2, 4))
        sent = numpy.concatenate(sent).transpose(0, 1, 2, 4, 3)  # [frame][chirp][sample][rx][I, Q]
        received, lost = [], 0
        with rosbag.Bag(self.path("demo.bag")) as bag:
            for _, message, _ in bag.read_messages("radar/adc"):
                received.append(numpy.array(message.samples, "<i2").reshape(2, 64, 4, 2))
                lost += message.lost_bytes
        self.assertEqual(lost, 0)
        self.assertEqual(len(received), len(sent))
        self.assertTrue(numpy.array_equal(numpy.array(received), sent))

    def test_live_ledger_and_offline_evaluation_agree(self):
        with rosbag.Bag(self.path("demo.bag")) as bag:
            ledger = [message for _, message, _ in bag.read_messages("attribution/ledger")][-1]
        with open(self.path("report", "summary.json")) as file:
            central = json.load(file)["central"]
        self.assertEqual(ledger.poses, POSES)
        self.assertEqual(central["poses"], POSES)
        self.assertAlmostEqual(ledger.recall, central["recall"], places=6)
        self.assertAlmostEqual(ledger.q1_energy, central["q1_energy"], places=3)
        self.assertAlmostEqual(ledger.q3_median_db, central["q3_median_db"], delta=0.1)

    def test_rviz_shows_both_fans(self):
        for name in ("rviz.png", "rviz_extended.png"):
            with self.subTest(name):
                self.check_fans(picture_pixels(self.path(name)))
        before_after = picture_pixels(self.path("rviz_before_after.png"))
        self.assertEqual(before_after.shape[0], 2 * picture_pixels(self.path("rviz.png")).shape[0])

    def check_fans(self, pixels):
        panels = pixels[:, -440:]  # of the maps: measured above simulated
        fans = fan_stretches(panels, 1)
        self.assertGreaterEqual(len(fans), 2, f"fans found in rows {fans}")
        # Each holds echoes too: the upper half of viridis, teal to yellow, has more green than blue or red in it.
        red, green, blue = panels[..., 0], panels[..., 1], panels[..., 2]
        echo = (green > 130) & (green > blue) & (green - numpy.minimum(red, blue) > 40)
        echo[:, -62:] = False  # colour bars
        middle = (fans[0][1] + fans[1][0]) // 2
        self.assertGreater(echo[fans[0][0]:middle].sum(), 100)
        self.assertGreater(echo[middle:fans[1][1]].sum(), 100)

    def test_report_shows_every_pose_and_what_was_counted_there(self):
        check_report(self, self.path("report"), [f"{i:03d}" for i in range(1, POSES + 1)])


if __name__ == "__main__":
    unittest.main()
