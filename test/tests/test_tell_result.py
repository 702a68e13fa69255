"""What the demo says of a diagnosis, and the status with which it ends."""
import json
import os
import subprocess
import tempfile
import unittest

import rospkg

PROGRAM = os.path.join(rospkg.RosPack().get_path("mmradartwin_launch"), "scripts", "tell_result.py")


def number(value, low, high):
    return {"value": value, "unit": "1", "ci95": [low, high]}


def finding(cause, **parameters):
    return {"cause": cause, "parameters": parameters,
            "gain": {"explained_power": {"before": 0.731, "after": 0.952, "difference_ci95": [0.2, 0.24]}}}


class TellResult(unittest.TestCase):
    def tell(self, effects, findings):
        """(status, standard output)"""
        with tempfile.TemporaryDirectory() as folder:
            files = []
            for name, content in (("truth", {"effects": effects}), ("findings", {"findings": findings})):
                files.append(os.path.join(folder, name + ".json"))
                with open(files[-1], "w", encoding="utf-8") as file:
                    json.dump(content, file)
            run = subprocess.run([PROGRAM, *files], capture_output=True, text=True, check=False)
        self.assertEqual(run.stderr, "")
        return run.returncode, run.stdout

    def test_a_value_inside_its_interval_is_right(self):
        status, said = self.tell([{"cause": "element_pattern", "parameters": {"cos_exponent": 2.1}}],
                                 [finding("element_pattern", cos_exponent=number(2.0, 1.9, 2.2))])
        self.assertEqual(status, 0)
        self.assertIn("cos_exponent 2 (95 %: 1.9 to 2.2)", said)
        self.assertIn("95 % of the measured power with it, 73 % without", said)
        self.assertIn("The diagnosis is right.", said)

    def test_a_value_outside_its_interval_is_right_within_the_tolerance_alone(self):
        truth = [{"cause": "element_pattern", "parameters": {"cos_exponent": 2.1}}]
        status, said = self.tell(truth, [finding("element_pattern", cos_exponent=number(1.6, 1.5, 1.7))])
        self.assertEqual(status, 0)
        self.assertIn("0.5 beside the hidden 2.1; up to 0.6 is accepted", said)
        status, said = self.tell(truth, [finding("element_pattern", cos_exponent=number(1.4, 1.3, 1.5))])
        self.assertEqual(status, 1)
        self.assertIn("NOT right", said)

    def test_a_number_without_a_tolerance_must_lie_inside_its_interval(self):
        truth = [{"cause": "range_bias", "parameters": {"bias_m": 0.1}}]
        self.assertEqual(self.tell(truth, [finding("range_bias", bias_m=number(0.1001, 0.09, 0.11))])[0], 0)
        self.assertEqual(self.tell(truth, [finding("range_bias", bias_m=number(0.1001, 0.10005, 0.11))])[0], 1)

    def test_another_cause_or_another_actor_is_wrong(self):
        truth = [{"cause": "actor_absent", "parameters": {"actor": "sofa"}}]
        self.assertEqual(self.tell(truth, [finding("actor_absent", actor={"value": "sofa"})])[0], 0)
        status, said = self.tell(truth, [finding("actor_absent", actor={"value": "door"})])
        self.assertEqual(status, 1)
        self.assertIn("actor is sofa, not door", said)
        status, said = self.tell(truth, [finding("actor_moved", actor={"value": "sofa"})])
        self.assertEqual(status, 1)
        self.assertIn("Found:  not this", said)
        self.assertIn("Also said: actor_moved", said)
        self.assertEqual(self.tell(truth, [])[0], 1)

    def test_of_two_hidden_causes_both_must_be_found(self):
        truth = [{"cause": "actor_absent", "parameters": {"actor": "sofa"}},
                 {"cause": "element_pattern", "parameters": {"cos_exponent": 2.1}}]
        found = [finding("element_pattern", cos_exponent=number(2.1, 2.0, 2.2)),
                 finding("actor_absent", actor={"value": "sofa"})]
        self.assertEqual(self.tell(truth, found)[0], 0)
        self.assertEqual(self.tell(truth, found[:1])[0], 1)

    def test_a_known_cause_is_told_in_words(self):
        moved = {"actor": "sofa", "dx_m": 0.1, "dy_m": -0.2}
        found = finding("actor_moved", actor={"value": "sofa"}, dx_m=number(0.12, 0.0, 0.2), dy_m=number(-0.2, -0.3, -0.1))
        status, said = self.tell([{"cause": "actor_moved", "parameters": moved}], [found])
        self.assertEqual(status, 0)
        self.assertIn("Hidden: sofa stands +0.10 m along x and -0.20 m along y from where the scene has it.\n", said)
        self.assertIn("Found:  sofa stands +0.12 m along x and -0.20 m along y", said)
        self.assertIn("\n        actor_moved: actor sofa; dx_m 0.12 m (95 %: 0 to 0.2); ", said)

    def test_a_list_has_an_interval_for_each_number(self):
        levels = {"value": [-36.5, -28.5], "unit": "dB", "ci95": [[-36.6, -36.4], [-28.6, -28.4]]}
        status, said = self.tell([{"cause": "iq_imbalance", "parameters": {}}], [finding("iq_imbalance", image_db=levels)])
        self.assertEqual(status, 0)
        self.assertIn("-36.5", said)

    def test_nothing_hidden_and_nothing_found_is_right(self):
        self.assertEqual(self.tell([], [])[0], 0)
        self.assertEqual(self.tell([], [finding("actor_absent", actor={"value": "sofa"})])[0], 1)

    def test_a_file_that_cannot_be_read_is_told(self):
        run = subprocess.run([PROGRAM, "/nowhere.json", "/nowhere.json"], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 2)
        self.assertRegex(run.stderr, r"^error: .*/nowhere\.json")


if __name__ == "__main__":
    unittest.main()
