#!/usr/bin/env python3
"""Diagnosis of a bag of a radar that is carried from place to place: when it moves by its frames and by tf."""
import os
import tempfile
import unittest

import yaml

from mmradartwin_tests.moving_bag import write_moving_bag
from mmradartwin_tests.session import Settings
from diagnose_program import PROGRAM, diagnose


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class LateTransforms(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def at(self, name):
        return os.path.join(self.folder.name, name)

    def carried(self, lag_s, seed):
        settings = Settings(output=self.at("room"), seed=seed, poses=5, headings=1, tier="office", duplicates=0)
        write_moving_bag(settings, self.at("carried.bag"), lag_s)

    def diagnosed(self, output, *options):
        status, findings, errors = diagnose(self.at("carried.bag"), self.at(output), *options)
        self.assertEqual(status, 0, msg=errors)
        return findings["findings"]

    def test_a_lag_is_named_and_nothing_is_once_the_twin_has_it(self):
        for seed, lag_s in ((5, 0.12), (7, -0.25)):
            with self.subTest(lag_s=lag_s, seed=seed):
                self.carried(lag_s, seed)
                scene = "--scene", self.at("room/scene.yaml")
                found = self.diagnosed(f"out_{seed}", *scene)
                # What stands still under late poses moves in part of each: nothing of that is to be named beside.
                self.assertEqual([f["cause"] for f in found], ["pose_time_lag"], msg=str(found))
                told = found[0]["parameters"]["lag_s"]
                self.assertEqual(told["unit"], "s")
                self.assertAlmostEqual(told["value"], lag_s, delta=0.02)
                self.assertLess(told["ci95"][0], lag_s)
                self.assertGreater(told["ci95"][1], lag_s)
                self.assertLess(told["ci95"][1] - told["ci95"][0], 0.1)
                extended = self.at(f"out_{seed}/twin.extended.yaml")
                with open(extended, encoding="ascii") as text:
                    self.assertAlmostEqual(yaml.safe_load(text)["mechanisms"]["pose_time_lag"]["lag_s"], told["value"])
                self.assertEqual(self.diagnosed(f"again_{seed}", *scene, "--twin", extended), [])
                # It takes no scene to see when frames change.
                alone = self.diagnosed(f"alone_{seed}")
                self.assertEqual([f["cause"] for f in alone], ["pose_time_lag"], msg=str(alone))
                self.assertEqual(alone[0]["parameters"], found[0]["parameters"])

    def test_transforms_in_time_are_no_finding(self):
        self.carried(0.0, 6)
        self.assertEqual(self.diagnosed("out", "--scene", self.at("room/scene.yaml")), [])


if __name__ == "__main__":
    unittest.main()
