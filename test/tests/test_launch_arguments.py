#!/usr/bin/env python3
"""What `roslaunch FILE --ros-args` tells of a launch file's arguments."""
import os
import re
import subprocess
import unittest

import rospkg

# What a user must give; all else has a default.
REQUIRED = {"demo.launch": {"session"}, "replay.launch": {"bag"}, "inspect.launch": {"results"}, "live.launch": set(),
            "record.launch": set(), "include/twin_chain.launch": set()}
ROW = re.compile(r"^  (?P<name>\w+)(?: \(default \"(?P<default>.*?)\"\))?: (?P<meaning>.*)$")


class LaunchArguments(unittest.TestCase):
    def setUp(self):
        self.folder = rospkg.RosPack().get_path("mmradartwin_launch")

    def arguments_of(self, name):
        """{argument: (default or None, meaning)} as a user sees them."""
        run = subprocess.run(["roslaunch", os.path.join(self.folder, name), "--ros-args"], capture_output=True, text=True,
                             timeout=120, check=False)
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        rows = [line for line in run.stdout.splitlines() if line.startswith("  ")]
        matches = [ROW.match(row) for row in rows]
        self.assertNotIn(None, matches, msg=rows)
        return {match["name"]: (match["default"], match["meaning"]) for match in matches}

    def test_every_launch_file_is_looked_at(self):
        found = {os.path.relpath(os.path.join(place, name), self.folder)
                 for place, _, names in os.walk(self.folder) for name in names if name.endswith(".launch")}
        self.assertEqual(found, set(REQUIRED))

    def test_only_what_must_be_given_is_listed_as_required(self):
        for name, required in REQUIRED.items():
            with self.subTest(launch=name):
                arguments = self.arguments_of(name)
                self.assertGreater(len(arguments), 4)
                self.assertEqual({key for key, (default, _) in arguments.items() if not default}, required)

    def test_every_argument_says_what_it_means(self):
        for name in REQUIRED:
            for key, (default, meaning) in self.arguments_of(name).items():
                with self.subTest(launch=name, argument=key):
                    self.assertNotIn("undocumented", meaning)
                    self.assertGreater(len(meaning.split()), 2)
                    # A word as default says what it stands for, and a switch what it switches.
                    if default in ("none", "generate", "hardware", "tf"):
                        self.assertIn(f"{default}: ", meaning)
                    if (default or "").lower() in ("true", "false"):
                        self.assertIn("true: ", meaning)
                        self.assertIn("false: ", meaning)
                    # A measure has its unit, a ratio what 1 is, a count its least.
                    if default and re.fullmatch(r"\d+(\.\d+)?", default):
                        self.assertRegex(meaning, r", (s|m|MB)\b|\b1: |\b1 or more")


if __name__ == "__main__":
    unittest.main()
