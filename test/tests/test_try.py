"""./run.sh try on the built workspace: a first finding, as somebody sees it who has just built everything."""
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest

import rosbag
import rospkg

SCRIPT = os.path.join(rospkg.RosPack().get_path("mmradartwin_launch"), "scripts", "try.sh")


def run(*arguments):
    return subprocess.run([SCRIPT, *arguments], capture_output=True, text=True, timeout=1800, check=False)


class Try(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.out = tempfile.mkdtemp(prefix="mmradartwin_try_")
        cls.first = run(cls.out)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.out, ignore_errors=True)

    def read(self, *parts):
        with open(os.path.join(self.out, *parts), encoding="utf-8") as file:
            return json.load(file)

    def test_finds_what_was_hidden(self):
        self.assertEqual(self.first.returncode, 0, self.first.stderr + self.first.stdout)
        hidden, found = self.read("truth.json")["effects"], self.read("diagnosis", "findings.json")["findings"]
        self.assertEqual([f["cause"] for f in found], [e["cause"] for e in hidden])
        self.assertEqual(found[0]["parameters"]["actor"]["value"], hidden[0]["parameters"]["actor"])
        for name in ("dx_m", "dy_m"):
            self.assertAlmostEqual(found[0]["parameters"][name]["value"], hidden[0]["parameters"][name], delta=0.08)

    def test_says_so_in_few_lines_and_names_a_page_that_is_there(self):
        said = self.first.stderr + self.first.stdout
        self.assertLessEqual(len(said.splitlines()), 25, said)
        self.assertRegex(said, r"Hidden: cabinet_north stands \+0\.00 m along x and -0\.25 m along y from where the scene has it")
        self.assertRegex(said, r"Found: +cabinet_north stands .*\n +actor_moved: .*dy_m -0\.2\d+ m \(95 %: -0\.\d+ to -0\.\d+\)")
        page = re.search(r"^Open this page: +(.*)$", self.first.stdout, re.MULTILINE).group(1)
        self.assertTrue(os.path.isfile(page), page)

    def test_session_and_bag_are_small_and_hold_the_same_frames(self):
        captures = os.path.join(self.out, "session", "captures")
        size = sum(os.path.getsize(os.path.join(captures, name)) for name in os.listdir(captures))
        bag = os.path.join(self.out, "sample.bag")
        self.assertLess(size + os.path.getsize(bag), 5e6)
        with rosbag.Bag(bag) as messages:
            cubes = [m for _, m, _ in messages.read_messages("/radar/adc")]
        self.assertEqual(sum(2 * len(m.samples) for m in cubes), size)

    def test_a_sample_that_is_no_sample_is_refused(self):
        with tempfile.TemporaryDirectory() as empty:
            refused = run(os.path.join(empty, "out"), empty)
        self.assertEqual(refused.returncode, 2)
        self.assertIn("must hold session/ and truth.json", refused.stderr)


if __name__ == "__main__":
    unittest.main()
