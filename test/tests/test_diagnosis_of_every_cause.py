"""Each effect of the catalogue is hidden once, plainly, in a small session, and its cause is the first that is found.

A usual run takes every second effect, by the day.
"""
import tempfile
import unittest

from mmradartwin_tests import effects
from mmradartwin_tests.session import Measurement, Settings
import catalogue
from chosen_sessions import NOT_TAKEN, is_of_half, print_day
from diagnose_program import PROGRAM, diagnose
from in_folder import InFolder
from stated_error import assert_told

ELSEWHERE = {"pose_time_lag"}   # of a radar that is carried: test_moving_bag
# Further sessions: what a cause looks like besides.
FURTHER = {
    "a_scan_too_small": ("scene_scale", {"scale": 0.01}),
    "images_of_receivers": ("iq_imbalance", {"image_db": [-36.5, -34.7, -28.5, -37.7]}),
}
SEED = 61
# Of 12 poses one has more than half of what floor and ceiling return; without it too little is left.
POSES = {"floor_ceiling_multipath": 20}


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class EveryCause(InFolder):
    """12 poses, six frames each. Every number that a finding states is right within its own interval."""

    @classmethod
    def setUpClass(cls):
        print_day()

    def first_of(self, cause, values):
        """(measurement, first finding) of one session with the cause in it."""
        measurement = Measurement(Settings(output=self.at("session"), seed=SEED, poses=POSES.get(cause, 12), headings=2,
                                           frames=6, tier="default", duplicates=0,
                                           effects=[effects.make_effect(cause, values, None)]))
        measurement.run()
        status, findings, errors = diagnose(self.at("session"), self.at("out"), "--findings", "1")
        self.assertEqual(status, 0, msg=errors)
        self.assertTrue(findings["findings"], msg="nothing is found")
        return measurement, findings["findings"][0]

    def test_level_by_total_power(self):
        """A law of poses that has a name and is no cause: dB of level for each dB of what the pose receives in all."""
        measurement, first = self.first_of("level_by_total_power", {})
        self.assertEqual(first["cause"], "unknown", msg=str(first))
        self.assertEqual(first["parameters"]["law"]["value"], "level_by_total_power", msg=str(first))
        law = first["mechanism"]["empirical_law"]
        slope = (law["gain_db"][-1] - law["gain_db"][0]) / (law["at"][-1] - law["at"][0])
        self.assertAlmostEqual(slope, measurement.truth()["effects"][0]["parameters"]["db_per_db"], delta=0.1)

    def check(self, cause, values, told_names=()):
        """One session. told_names: of parameters that the finding has to state."""
        measurement, first = self.first_of(cause, values)
        self.assertEqual(first["cause"], cause, msg=str(first))
        truth, = measurement.truth()["effects"]
        for name, told in first["parameters"].items():
            if told.get("ci95") and name in truth["parameters"]:
                assert_told(self, told, truth["parameters"][name],
                            msg=f"{name} of {cause}")
        for name in told_names:
            told = first["parameters"].get(name, {}).get("value")
            self.assertIsNotNone(told, msg=str(first))
            self.assertEqual(isinstance(told, list), isinstance(values[name], list), msg=str(first))
            if isinstance(values[name], (str, int)):
                self.assertEqual(told, values[name])


def test_of(cause, values, told_names=()):
    """A test's method."""
    return lambda self: self.check(cause, values, told_names)


SESSIONS = {**{one: (one, effects.EFFECTS[one].plain) for one in effects.EFFECTS},
            **{name: (one, values, values) for name, (one, values) in FURTHER.items()}}
for at, (name, asked) in enumerate(SESSIONS.items()):
    setattr(EveryCause, f"test_{name}", unittest.skipUnless(is_of_half(at), NOT_TAKEN)(test_of(*asked)))


@unittest.skipIf(catalogue.PROGRAM is None, "mmradartwin_sim simulate is not built in this workspace")
class Causes(unittest.TestCase):
    def test_none_of_the_catalogue_is_left_out(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(set(effects.EFFECTS) | ELSEWHERE, catalogue.shipped_causes(folder))


if __name__ == "__main__":
    unittest.main()
