"""Each cause of the catalogue is hidden once, plainly, in a small session, and is the first one that is found."""
import tempfile
import unittest

from mmradartwin_tests import effects
from mmradartwin_tests.session import Measurement, Settings
import catalogue
from diagnose_program import PROGRAM, diagnose
from in_folder import InFolder
from stated_error import assert_told

# Parameters beside the effects' own typical values. Those given are stronger: twelve poses within some minutes show
# less than a campaign does.
CAUSES = {
    "actor_absent": {},
    "actor_moved": {"distance_m": 0.4},
    "actor_unmodelled": {},
    "adc_saturation": {},
    "carrier_scale": {},
    "channel_conjugation": {},
    "channel_permutation": {},
    "channel_phase_error": {},
    "corner_reflection": {},
    "dc_offset": {},
    "diffuse_scattering": {},
    "edge_diffraction": {},
    "element_pattern": {},
    "elevation_pattern": {"cos_exponent": 30.0},
    "excess_attenuation": {"db_per_m": 2.0},
    "floor_ceiling_multipath": {},
    "gain_drift": {"db_per_hour": 120.0},
    "if_highpass": {},
    "if_lowpass": {"corner_hz": 1.8e6},
    "interference": {},
    "iq_conjugation": {},
    "iq_imbalance": {},
    "material_reflectivity": {"material": "Concrete", "delta_db": -12.0},
    "moving_target": {},
    "noise_floor": {},
    "packet_loss": {},
    "packet_misalignment": {},
    "phase_drift": {},
    "radar_pitch_offset": {"pitch_deg": 8.0},
    "radar_position_offset": {},
    "radar_yaw_offset": {},
    "range_bias": {},
    "range_scale": {"scale": 0.03},
    "scene_registration": {},
    "second_harmonic": {},
    "surface_roughness": {},
    "transmission": {},
    "tx_imbalance": {},
    "tx_rx_leakage": {},
    "wall_ghost": {},
}
ELSEWHERE = {"pose_time_lag"}   # of a radar that is carried: test_moving_bag
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


@unittest.skipIf(catalogue.PROGRAM is None, "mmradartwin_sim simulate is not built in this workspace")
class Causes(unittest.TestCase):
    def test_none_of_the_catalogue_is_left_out(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(set(CAUSES) | ELSEWHERE, catalogue.shipped_causes(folder))


if __name__ == "__main__":
    unittest.main()
