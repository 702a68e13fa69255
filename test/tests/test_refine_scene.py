#!/usr/bin/env python3
"""What a session's echoes say of the places of a scene's actors, against the errors with which it was measured."""
import os
import subprocess
import unittest

import numpy as np
import yaml

from mmradartwin_tests import effects
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.session import Measurement, Settings
from in_folder import InFolder

PROGRAM = find_program("mmradartwin_attribution", "refine_scene")
SCENE_M = 0.02


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution refine_scene is not built in this workspace")
class RefineScene(InFolder):
    def refine(self, session, *options):
        return subprocess.run([PROGRAM, session, "--output", self.at("refined"), *options], capture_output=True, text=True,
                              check=False, timeout=900)

    def test_actors_are_found_where_they_are(self):
        measurement = Measurement(Settings(output=self.at("session"), seed=63, poses=24, locations=8, headings=4, frames=10,
                                           tier="office", duplicates=0, actor_range_m=SCENE_M))
        measurement.run()
        run = self.refine(self.at("session"))
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        with open(self.at("refined", "refinement.yaml"), encoding="utf-8") as text:
            told = yaml.safe_load(text)
        self.assertEqual((told["format"], told["scene_m"], told["poses"]), ("mmradartwin_refinement/1", SCENE_M, 24))
        names = list(told["actors"])
        self.assertGreaterEqual(len(names), 6, msg=run.stdout)
        truth_m = np.array([measurement.actor_range_m[[a.name for a in measurement.room.actors].index(name)] for name in names])
        range_m, std_m = (np.array([told["actors"][name][key] for name in names]) for key in ("range_m", "std_m"))
        # What all actors share is no error of the scene: it is compared without.
        weight = 1 / std_m**2
        truth_m = truth_m - np.average(truth_m, weights=weight)
        left_m = truth_m - (range_m - np.average(range_m, weights=weight))
        self.assertLess(np.sqrt(np.mean(left_m**2)), np.sqrt(np.mean(truth_m**2)) / 2, msg=run.stdout)
        self.assertLess(np.mean((left_m / std_m)**2), 2.5, msg=run.stdout)
        low, high = told["held_out_nats_per_pose"]["difference_ci95"]
        self.assertGreater(low, 0, msg=run.stdout)
        self.assertLess(low, high)

    def test_a_body_is_found_where_it_went(self):
        moved_m = np.array([0.025, -0.018])
        effect = effects.make_effect("actor_moved", {"actor": "pillar", "dx_m": moved_m[0], "dy_m": moved_m[1]}, None)
        Measurement(Settings(output=self.at("session"), seed=71, poses=24, locations=12, headings=4, frames=8, duplicates=0,
                             effects=[effect])).run()
        run = self.refine(self.at("session"))
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        with open(self.at("refined", "refinement.yaml"), encoding="utf-8") as text:
            actors = yaml.safe_load(text)["actors"]
        left_m = np.array(actors["pillar"]["shift_m"]) - moved_m
        self.assertLess(np.hypot(*left_m), np.hypot(*moved_m) / 3, msg=run.stdout)
        for name, actor in actors.items():
            if name != "pillar" and "shift_m" in actor:
                self.assertLess(np.hypot(*actor["shift_m"]), np.hypot(*moved_m) / 3, msg=name)

    def test_a_session_without_a_scene_is_refused_in_one_line(self):
        Measurement(Settings(output=self.at("session"), seed=64, poses=3, headings=1, frames=2, duplicates=0)).run()
        file = self.at("session", "session.yaml")
        with open(file, encoding="utf-8") as text:
            lines = [line for line in text if not line.startswith(("scene:", "twin:"))]
        with open(file, "w", encoding="utf-8") as text:
            text.writelines(lines)
        run = self.refine(self.at("session"))
        self.assertEqual(run.returncode, 2, msg=run.stderr)
        self.assertIn("names no scene that could be refined", run.stderr)
        self.assertEqual(len([line for line in run.stderr.splitlines() if line.startswith("error")]), 1, msg=run.stderr)
        self.assertFalse(os.path.exists(self.at("refined")))


if __name__ == "__main__":
    unittest.main()
