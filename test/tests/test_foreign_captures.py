"""Captures that are not what radar.yaml says, given to the programs: what they are is said, and nothing else is named."""
import csv
import glob
import json
import math
import os
import shutil
import struct
import subprocess
import tempfile
import unittest

import numpy as np

from mmradartwin_tests.blind import recordings
from mmradartwin_tests.installed_programs import find_program
from diagnose_program import PROGRAM, diagnose
from paper_radar import PAPER_RADAR

PROCESS = find_program("mmradartwin_dsp", "process")
EVALUATE = find_program("mmradartwin_attribution", "evaluate")
RADAR = PAPER_RADAR.format(loops=1, frame_period_s=0.05)
SHEET = "v 3 -0.5 0.6\nv 3 0.5 0.6\nv 3 0.5 1.4\nv 3 -0.5 1.4\nf 1 2 3 4\n"


def point_target(frames=100, amplitude=3000, range_m=3.0, azimuth_deg=20.0):
    """I and Q [chirp, receiver, sample] of a point target, as counts."""
    k, n = np.arange(8)[:, None], np.arange(64)
    phase = (2 * np.pi * 75e12 * (2 * range_m / 299792458.0) * n / 5e6
             - 1.012 * np.pi * k * np.sin(np.radians(azimuth_deg)))
    phase = np.tile(phase.reshape(2, 4, 64), (frames, 1, 1))
    return np.rint(amplitude * np.cos(phase)).astype("<i2"), np.rint(amplitude * np.sin(phase)).astype("<i2")


def four_lanes(i, q):
    """Per sample I of all receivers, then Q."""
    return np.stack([i, q], axis=1).transpose(0, 3, 1, 2).tobytes()


def two_lanes(i, q):
    """Per receiver I of two samples, then Q."""
    pairs = (*i.shape[:2], -1, 2)
    return np.stack([i.reshape(pairs), q.reshape(pairs)], axis=3).tobytes()


def with_heads(data, with_size, payload=1456):
    """The card's heads of datagrams, or those of its command-line tool."""
    parts = []
    for number, at in enumerate(range(0, len(data), payload)):
        part = data[at:at + payload]
        head = struct.pack("<II", number + 1, len(part)) if with_size else struct.pack("<I", number + 1)
        parts.append(head + struct.pack("<Q", at)[:6] + part)
    return b"".join(parts)


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, data):
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "wb") as file:
            file.write(data if isinstance(data, bytes) else data.encode())
        return self.path(name)


@unittest.skipIf(PROCESS is None, "mmradartwin_dsp process is not built in this workspace")
class OfOneTarget(InFolder):
    """process, of a point target at 3.0 m and 20 degrees."""

    def process(self, name, *options, radar=RADAR):
        self.write("radar.yaml", radar)
        shutil.rmtree(self.path("out"), ignore_errors=True)
        run = subprocess.run([PROCESS, self.path(name), "--radar", self.path("radar.yaml"), "--output",
                              self.path("out"), *options], capture_output=True, text=True, check=False)
        return run.returncode, run.stderr

    def peak(self):
        """(range, azimuth, level) of the strongest cell of the only map."""
        file, = glob.glob(self.path("out/maps/*.csv"))
        with open(file, encoding="ascii") as text:
            cells = [(float(c["range_m"]), float(c["azimuth_deg"]), float(c["power_db"]))
                     for c in csv.DictReader(text) if c["power_db"] not in ("", "nan")]
        return max(cells, key=lambda cell: cell[2])

    def check_target(self, status, errors):
        self.assertEqual(status, 0, msg=errors)
        range_m, azimuth_deg, power_db = self.peak()
        self.assertAlmostEqual(range_m, 3.0, delta=0.08)
        self.assertAlmostEqual(azimuth_deg, 20.0, delta=1.0)
        self.assertAlmostEqual(power_db, 20 * math.log10(3000 / 32768), delta=0.6)    # up to half a bin's loss

    def check_refused(self, data, *said, radar=RADAR):
        self.write("a.bin", data)
        status, errors = self.process("a.bin", radar=radar)
        self.assertEqual(status, 2, msg=errors)
        for words in said:
            self.assertIn(words, errors)
        self.assertEqual(glob.glob(self.path("out/maps/*.csv")), [])

    def test_as_stated(self):
        self.write("a.bin", four_lanes(*point_target()))
        status, errors = self.process("a.bin")
        self.check_target(status, errors)
        self.assertNotIn("note:", errors)

    def test_other_layouts(self):
        self.check_refused(two_lanes(*point_target()), "bytes look like 2lane", "set layout: 2lane")
        self.check_refused(four_lanes(*point_target()), "bytes look like 4lane", radar=RADAR + "layout: 2lane\n")

    def test_real_samples(self):
        data = point_target()[0].transpose(0, 2, 1).tobytes()
        self.check_refused(data, "samples look real, not complex", "samples: real")
        self.check_target(*self.process("a.bin", radar=RADAR + "samples: real\n"))
        with open(glob.glob(self.path("out/maps/*.csv"))[0], encoding="ascii") as text:
            farthest = max(float(cell["range_m"]) for cell in csv.DictReader(text))
        self.assertAlmostEqual(farthest, 31 * 299792458.0 / (2 * 960e6), delta=0.001)    # half of the complex range

    def test_beginning_within_a_frame(self):
        for data, radar in ((four_lanes(*point_target()), RADAR),
                            (two_lanes(*point_target()), RADAR + "layout: 2lane\n")):
            self.check_refused(data[1096:] + data[:1096], "begins 1096 bytes into a frame", "--align", radar=radar)
            status, errors = self.process("a.bin", "--align", radar=radar)
            self.check_target(status, errors)
            self.assertIn("note:", errors)

    def test_heads(self):
        for with_size in (True, False):
            self.write("a.bin", with_heads(four_lanes(*point_target()), with_size))
            status, errors = self.process("a.bin")
            self.check_target(status, errors)
            self.assertIn("packet heads of " + ("14" if with_size else "10") + " bytes", errors)

    def test_parts(self):
        data = four_lanes(*point_target())
        self.write("adc_data_0.bin", data[:100000])
        self.write("adc_data_1.bin", data[100000:])
        status, errors = self.process("adc_data_0.bin")
        self.check_target(status, errors)
        self.assertIn("adc_data_1.bin", errors)
        # The second part alone would be no whole frame, the first neither.
        self.assertNotIn("truncated", errors)

    def test_dead_receivers(self):
        for dead, value, words in (((2,), 0, "only zeros"), ((2, 3), -1, "only a constant -1")):
            i, q = point_target()
            for receiver in dead:
                i[:, receiver] = q[:, receiver] = value
            self.write("a.bin", four_lanes(i, q))
            status, errors = self.process("a.bin")
            self.check_target(status, errors)
            for receiver in dead:
                self.assertIn(f"receiver {receiver} delivers {words} at all poses", errors)

    def test_no_samples(self):
        self.check_refused(bytes(100 * 2048), "all its samples are zero")
        self.check_refused(b"", "empty file")
        self.check_refused(b"\x93NUMPY\x01\x00v\x00" + bytes(118) + four_lanes(*point_target()), "NumPy")
        self.check_refused(b"PK\x03\x04" + four_lanes(*point_target())[4:], "zip")
        self.check_refused(b"chirp, sample, I, Q\n" + b"0, 1, 20, -3\n" * 400, "is a text")


@unittest.skipIf(EVALUATE is None, "mmradartwin_attribution evaluate is not built in this workspace")
class InEvaluation(InFolder):
    """evaluate refuses and reads as process does, with a metal sheet for a scene."""

    def evaluate(self, data, *options):
        self.write("s/radar.yaml", RADAR)
        self.write("s/sheet.obj", SHEET)
        self.write("s/scene.yaml", "meshes:\n  - {file: sheet.obj}\nmaterials: materials.yaml\n"
                                   "actors: {sheet: {material: Metal}}\n")
        self.write("s/materials.yaml", "materials:\n  Metal: {model: conductor}\n")
        self.write("s/session.yaml", "format: mmradartwin_session/1\nradar: radar.yaml\nscene: scene.yaml\n"
                                     "poses: poses.csv\ncaptures: captures/{pose}.bin\n")
        self.write("s/poses.csv", "pose,location,stamp,x,y,z,qx,qy,qz,qw\n001,01,1760000000.0,0,0,1,0,0,0,1\n")
        self.write("s/captures/001.bin", data)
        run = subprocess.run([EVALUATE, self.path("s"), "--output", self.path("out"), "--no-bag", *options],
                             capture_output=True, text=True, check=False)
        return run.returncode, run.stderr

    def test_the_check_comes_first(self):
        i, q = point_target(azimuth_deg=0.0)
        status, errors = self.evaluate(two_lanes(i, q))
        self.assertEqual(status, 2)
        self.assertIn("bytes look like 2lane", errors)
        i[:, 1] = q[:, 1] = 0
        status, errors = self.evaluate(four_lanes(i, q))
        self.assertEqual(status, 0, msg=errors)
        self.assertIn("receiver 1 delivers only zeros", errors)


def parameter(finding, name):
    return finding["parameters"][name]["value"]


def numbers(value):
    """All numbers of a JSON document."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return [number for part in value for number in numbers(part)]
    return [value] if isinstance(value, (int, float)) else []


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
@unittest.skipIf(recordings.capture_file() is None,
                 "openradar_indoor is not here; set MMRADARTWIN_DATA to the folder with the real recordings")
class RealRecording(InFolder):
    """diagnose, of two people who walk near 3 m, under disguises."""

    def setUp(self):
        super().setUp()
        with open(recordings.capture_file(), "rb") as file:
            self.data = file.read()

    def diagnose(self, data, *options):
        shutil.rmtree(self.path("s"), ignore_errors=True)
        shutil.rmtree(self.path("out"), ignore_errors=True)
        recordings.write_payload(self.path("s"), data)
        return diagnose(self.path("s"), self.path("out"), *options)

    def check_people(self, data, *more, options=(), said=()):
        """The two people and what the recording has of its own; returns the findings."""
        status, findings, errors = self.diagnose(data, *options)
        self.assertEqual(status, 0, msg=errors)
        for words in said:
            self.assertIn(words, errors)
        causes = [finding["cause"] for finding in findings["findings"]]
        self.assertEqual(causes.count("moving_target"), 2, msg=causes)
        self.assertLessEqual(set(causes), {"moving_target", "channel_phase_error", "tx_rx_leakage", *more})
        self.assertLessEqual(set(more), set(causes))
        for finding in findings["findings"]:
            if finding["cause"] == "moving_target":
                self.assertAlmostEqual(math.hypot(parameter(finding, "x_m"), parameter(finding, "y_m")), 3.0, delta=0.2)
        self.assertTrue(all(math.isfinite(number) for number in numbers(findings)))
        return findings

    def check_refused(self, data, *said):
        status, findings, errors = self.diagnose(data)
        self.assertEqual(status, 2, msg=errors)
        self.assertIsNone(findings)
        for words in said:
            self.assertIn(words, errors)

    def test_as_it_is(self):
        self.check_people(self.data)

    def test_dead_receivers(self):
        words = np.frombuffer(self.data, "<i2").copy()
        words[2::8] = words[6::8] = 0
        self.check_people(words.tobytes(), said=["receiver 2 delivers only zeros at all poses"])
        for lane in (2, 3, 6, 7):
            words[lane::8] = -1
        self.check_people(words.tobytes(), said=["receiver 2 delivers only a constant -1",
                                                 "receiver 3 delivers only a constant -1"])

    def test_exchanged_layout(self):
        with open(os.path.join(os.path.dirname(recordings.capture_file()), "xwr18xx_2lane_adc_data.bin"), "rb") as file:
            self.check_refused(file.read(), "bytes look like 2lane", "set layout: 2lane")

    def test_real_part_alone(self):
        words = np.frombuffer(self.data, "<i2").reshape(-1, 2, 4)[:, 0]    # I of each sample; twice, to fill the frame
        self.check_refused(np.concatenate([words, words]).tobytes(), "real samples in 4lane", "nothing was judged")

    def test_beginning_within_a_frame(self):
        shifted = self.data[1096:] + self.data[:1096]
        findings = self.check_people(shifted, "packet_misalignment")
        found = next(f for f in findings["findings"] if f["cause"] == "packet_misalignment")
        self.assertIn("begins 1096 bytes into a frame", found["description"])
        self.check_people(shifted, options=["--align"], said=["begins 1096 bytes into a frame"])

    def test_heads(self):
        untouched = self.check_people(self.data)
        for with_size in (True, False):
            findings = self.check_people(with_heads(self.data, with_size), said=["packet heads"])
            self.assertEqual(json.dumps(findings["findings"]), json.dumps(untouched["findings"]))


if __name__ == "__main__":
    unittest.main()
