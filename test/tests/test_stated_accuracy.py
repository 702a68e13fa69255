"""A session is judged by the accuracy that its user states of scene, levels and poses."""
import shutil
import unittest

from mmradartwin_tests import effects
from mmradartwin_tests.session import Measurement, Settings
from diagnose_program import PROGRAM, diagnose
from in_folder import InFolder


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class StatedAccuracy(InFolder):
    def diagnosed(self, stated, output):
        """Diagnosis of a copy of the session that states this accuracy."""
        session = self.at(output + "_session")
        shutil.copytree(self.at("session"), session)
        with open(self.at(output + "_session", "session.yaml"), "a", encoding="ascii") as file:
            file.write(stated)
        return diagnose(session, self.at(output), "--findings", "1")

    def test_a_move_within_the_stated_error_of_the_scene_is_no_finding(self):
        Measurement(Settings(output=self.at("session"), seed=25, poses=10, locations=8, headings=4, frames=10,
                             tier="office", duplicates=0,
                             effects=[effects.make_effect("actor_moved", {}, None)])).run()
        status, as_shipped, errors = self.diagnosed("", "shipped")
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual([f["cause"] for f in as_shipped["findings"]], ["actor_moved"])
        self.assertEqual(as_shipped["accuracy"]["scene_m"]["stated"], 0.02)
        self.assertIsNone(as_shipped["accuracy"]["pose_m"]["estimated"], msg="no echo shows it")

        status, rough, errors = self.diagnosed("accuracy: {scene_m: 0.1, level_db: 3}\n", "rough")
        self.assertEqual(status, 0, msg=errors)
        self.assertNotIn("actor_moved", [f["cause"] for f in rough["findings"]])
        self.assertEqual(rough["accuracy"]["scene_m"]["stated"], 0.1)
        self.assertEqual(rough["accuracy"]["pose_m"]["stated"], 0.004, msg="a key that is left out keeps its default")

        status, nothing, errors = self.diagnosed("accuracy: {scene_m: 7}\n", "wrong")
        self.assertEqual((status, nothing), (2, None))
        for part in ("session.yaml", "scene_m", "7", "0.5"):
            self.assertIn(part, errors)

    def made(self, seed, scene_m, level_db):
        """Findings, and what the program tells, of a session without effects whose actors err by this much."""
        Measurement(Settings(output=self.at("session"), seed=seed, poses=24, locations=8, headings=4, frames=10,
                             tier="office", duplicates=0, actor_range_m=scene_m, actor_gain_db=level_db)).run()
        status, found, errors = diagnose(self.at("session"), self.at("diagnosis"))
        self.assertEqual(status, 0, msg=errors)
        with open(self.at("diagnosis", "report.html"), encoding="utf-8") as page:
            return found, page.read()

    def test_errors_as_stated_are_found_as_stated(self):
        found, page = self.made(61, 0.02, 1.5)
        self.assertEqual(found["findings"], [])
        for key, true in (("scene_m", 0.02), ("level_db", 1.5), ("heading_deg", 0.3)):
            self.assertTrue(true / 1.6 < found["accuracy"][key]["estimated"] < 1.6 * true, msg=f"{key} {found['accuracy']}")
        self.assertNotIn("is stated", page)

    def test_a_scene_far_worse_than_stated_is_told_and_names_no_cause(self):
        found, page = self.made(62, 0.06, 1.5)
        self.assertEqual(found["findings"], [])
        self.assertEqual(found["accuracy"]["scene_m"]["stated"], 0.02)
        self.assertTrue(0.03 < found["accuracy"]["scene_m"]["estimated"] < 0.09, msg=found["accuracy"])
        self.assertIn("where 0.02 m is stated (scene_m)", page)

    def test_levels_better_than_stated_are_found_so(self):
        found, _ = self.made(63, 0.006, 0.3)
        self.assertEqual(found["findings"], [])
        self.assertLess(found["accuracy"]["level_db"]["estimated"], 0.8)
        self.assertLess(found["accuracy"]["scene_m"]["estimated"], 0.01)
