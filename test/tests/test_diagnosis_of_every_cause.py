"""Causes are hidden one by one, plainly, in a small session, and are the first one that is found."""
import unittest

from mmradartwin_tests import effects
from mmradartwin_tests.session import Measurement, Settings
from diagnose_program import PROGRAM, diagnose
from in_folder import InFolder
from stated_error import assert_told

# Parameters beside the effects' own typical values.
CAUSES = {
    "actor_absent": {},
    "adc_saturation": {},
    "carrier_scale": {},
    "dc_offset": {},
    "floor_ceiling_multipath": {},
    "if_highpass": {},
    "interference": {},
    "iq_conjugation": {},
    "iq_imbalance": {},
    "noise_floor": {},
    "packet_misalignment": {},
    "phase_drift": {},
    "range_bias": {},
    "second_harmonic": {},
    "transmission": {},
    "tx_rx_leakage": {},
}
SEED = 61


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class EveryCause(InFolder):
    """12 poses at six places, six frames each. Every number that a finding states is right within its own interval."""

    def check(self, cause):
        """One session with the cause in it."""
        measurement = Measurement(Settings(output=self.at("session"), seed=SEED, poses=12, headings=2,
                                           frames=6, tier="default", duplicates=0,
                                           effects=[effects.make_effect(cause, CAUSES[cause], None)]))
        measurement.run()
        status, findings, errors = diagnose(self.at("session"), self.at("out"), "--findings", "1")
        self.assertEqual(status, 0, msg=errors)
        self.assertTrue(findings["findings"], msg="nothing is found")
        first = findings["findings"][0]
        self.assertEqual(first["cause"], cause, msg=str(first))
        truth, = measurement.truth()["effects"]
        for name, told in first["parameters"].items():
            if told.get("ci95") and name in truth["parameters"]:
                assert_told(self, told, truth["parameters"][name], msg=f"{name} of {cause}")


def test_of(cause):
    """A test's method."""
    return lambda self: self.check(cause)


for one in CAUSES:
    setattr(EveryCause, f"test_{one}", test_of(one))


if __name__ == "__main__":
    unittest.main()
