"""What a diagnosis finds where no scene says what to expect: in a real recording, and in sessions without one."""
import math
import os
import shutil
import tempfile
import unittest

import numpy as np

from mmradartwin_tests import effects
from mmradartwin_tests.blind import recordings
from mmradartwin_tests.session import Measurement, Settings
from diagnose_program import PROGRAM, diagnose
from made_wall import WALL


def causes(findings):
    return [f["cause"] for f in findings["findings"]]


def parameter(findings, cause, name):
    """Value of the first finding of a cause."""
    return next(f for f in findings["findings"] if f["cause"] == cause)["parameters"][name]["value"]


def bent(phases_deg):
    """What is left of receivers' phases once a slope is taken out, which is a direction."""
    x = np.arange(len(phases_deg))
    return np.array(phases_deg) - np.polyval(np.polyfit(x, phases_deg, 1), x)


class InFolder(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.session, self.output = (os.path.join(self.folder.name, name) for name in ("session", "out"))

    def diagnosed(self):
        status, findings, errors = diagnose(self.session, self.output)
        self.assertEqual(status, 0, msg=errors)
        return findings


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
@unittest.skipIf(recordings.capture_file() is None,
                 "openradar_indoor is not here; set MMRADARTWIN_DATA to the folder with the real recordings")
class RealRecording(InFolder):
    def injected(self, name, seed):
        """Diagnosis of the recording with an effect in it, and the effect's parameters."""
        data, truth = recordings.inject(name, np.random.default_rng(seed))
        recordings.write_payload(self.session, data)
        return self.diagnosed(), truth

    def check_untouched(self):
        findings = self.diagnosed()
        self.assertEqual(sorted(causes(findings)), ["channel_phase_error", "moving_target", "moving_target",
                                                    "tx_rx_leakage"])
        leakage = next(f for f in findings["findings"] if f["cause"] == "tx_rx_leakage")
        self.assertIn("no array response", leakage["description"])
        self.assertLess(leakage["parameters"]["range_m"]["value"], 0.1)
        # The strongest cells of the two who walk, by range and Doppler: what bends each receiver's phases there.
        x = recordings.read_capture()
        window = np.hanning(129)[:128]
        cells = np.fft.fft(np.fft.fft(x * window[:, None], axis=2) * window[:, None, None, None], axis=0)
        power = (np.abs(cells[:, :, 40:100])**2).sum(axis=(1, 3))
        power[:3] = power[-2:] = 0
        measured = []
        for _ in range(3):
            doppler, bin_number = np.unravel_index(power.argmax(), power.shape)
            power[max(0, doppler - 2):doppler + 3, max(0, bin_number - 2):bin_number + 3] = 0
            for slot in range(2):
                y = cells[doppler, slot, 40 + bin_number]
                measured.append(bent(np.degrees(np.unwrap(np.angle(y * y[0].conj())))))
        phases = parameter(findings, "channel_phase_error", "phase_deg")
        for block in (phases[:4], phases[4:]):
            np.testing.assert_allclose(bent(block), np.mean(measured, axis=0), atol=3.0)
        np.testing.assert_allclose(np.diff(phases[:4]), np.diff(phases[4:]), atol=1e-6)    # the same under both
        walkers = [f for f in findings["findings"] if f["cause"] == "moving_target"]
        for walker in walkers:
            self.assertAlmostEqual(math.hypot(walker["parameters"]["x_m"]["value"],
                                              walker["parameters"]["y_m"]["value"]), 3.0, delta=0.15)
        return findings

    def test_leakage_receivers_and_two_people_and_nothing_else(self):
        recordings.write_untouched(self.session)
        self.check_untouched()

    def test_the_same_with_its_wall_for_a_scene(self):
        recordings.write_untouched(self.session)
        files = {"wall.ply": WALL, "scene.yaml": "meshes:\n  - {file: wall.ply}\nmaterials: materials.yaml\n"
                                                 "actors: {wall: {material: Concrete}}\n"}
        for name, text in files.items():
            with open(os.path.join(self.session, name), "w", encoding="ascii") as out:
                out.write(text)
        shutil.copy(os.path.join(recordings.REPOSITORY, "config", "office", "materials.yaml"), self.session)
        with open(os.path.join(self.session, "session.yaml"), "a", encoding="ascii") as out:
            out.write("scene: scene.yaml\n")
        self.check_untouched()

    def test_twins_are_compared_in_a_scene_alone(self):
        recordings.write_payload(self.session, recordings.inject("packet_loss", np.random.default_rng(3))[0])
        status, _, errors = diagnose(self.session, self.output, "--compare", "other.yaml")
        self.assertEqual(status, 2)
        self.assertIn("names no scene", errors)

    def test_conjugated_samples_are_seen_by_the_leakage_and_undone(self):
        findings, _ = self.injected("iq_conjugation", 1)
        self.assertIn("iq_conjugation", causes(findings))
        self.assertEqual(len(findings["findings"]), 5)
        self.assertLess(parameter(findings, "moving_target", "y_m"), 0)    # where he walks in the recording as it is

    def test_a_mirrored_array_is_seen_by_what_moves(self):
        findings, _ = self.injected("channel_conjugation", 1)
        self.assertIn("channel_conjugation", causes(findings))
        self.assertEqual(len(findings["findings"]), 5)
        self.assertLess(parameter(findings, "moving_target", "y_m"), 0)

    def test_errors_of_channels_add_up_with_the_radars_own(self):
        before = self.check_untouched_phases()
        findings, truth = self.injected("channel_phase_error", 5)
        added = np.array(parameter(findings, "channel_phase_error", "phase_deg")) - before
        np.testing.assert_allclose(bent(added), bent(truth["phase_deg"]), atol=2.0)

    def check_untouched_phases(self):
        recordings.write_untouched(self.session)
        phases = np.array(parameter(self.diagnosed(), "channel_phase_error", "phase_deg"))
        shutil.rmtree(self.session)
        return phases


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class SessionWithoutScene(InFolder):
    """Of the test office, six frames at twelve poses of six places; MMRADARTWIN_DIAGNOSIS_SEED gives others."""

    def found(self, seed, hidden, poses=12):
        """Findings, and the true parameters of what was hidden."""
        seed += int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "0"))
        chosen = [effects.make_effect(name, values, None) for name, values in hidden.items()]
        measurement = Measurement(Settings(output=self.session, seed=seed, poses=poses, headings=2, frames=6,
                                           tier="office", effects=chosen))
        measurement.run()
        description = os.path.join(self.session, "session.yaml")
        with open(description, encoding="ascii") as text:
            lines = [line for line in text if not line.startswith(("scene:", "twin:"))]
        with open(description, "w", encoding="ascii") as text:
            text.writelines(lines)
        truth = measurement.truth()["effects"]
        return self.diagnosed(), truth[0]["parameters"] if truth else None

    def test_nothing_hidden_is_none(self):
        for seed, poses in ((301, 1), (309, 12)):
            findings, _ = self.found(seed, {}, poses)
            self.assertEqual(findings["verdict"], "none", msg=f"seed {seed}: {findings}")
            shutil.rmtree(self.session)

    def test_a_transmitters_phase_and_gain(self):
        findings, truth = self.found(323, {"tx_imbalance": {"phase_deg": 25.0, "gain_db": 1.0}})
        self.assertEqual(causes(findings), ["tx_imbalance"])
        for name, value in truth.items():
            low, high = findings["findings"][0]["parameters"][name]["ci95"]
            self.assertTrue(low < value < high, msg=f"{name}: {low} to {high}, not {value}")
            self.assertLess(high - low, 3.0)

    def test_errors_of_channels_but_for_a_turn_of_the_radar(self):
        findings, truth = self.found(321, {"channel_phase_error": {"rms_deg": 12.0, "rms_db": 0.6}})
        self.assertEqual(causes(findings), ["channel_phase_error"])
        values = findings["findings"][0]["parameters"]
        np.testing.assert_allclose(bent(values["phase_deg"]["value"]), bent(truth["phase_deg"]), atol=1.0)
        np.testing.assert_allclose(values["gain_db"]["value"], truth["gain_db"], atol=0.25)

    def test_a_wrong_order_of_lanes(self):
        order = [1, 0, 3, 2, 5, 4, 7, 6]
        findings, _ = self.found(326, {"channel_permutation": {"order": order}})
        self.assertEqual(causes(findings), ["channel_permutation"])
        self.assertEqual(parameter(findings, "channel_permutation", "order"), order)

    def test_transmitters_exchanged_are_as_likely_as_the_mirrored_lanes(self):
        exchanged, mirrored = [4, 5, 6, 7, 0, 1, 2, 3], [3, 2, 1, 0, 7, 6, 5, 4]
        findings, _ = self.found(327, {"channel_permutation": {"order": exchanged}})
        self.assertEqual(causes(findings), ["channel_permutation"])
        first = findings["findings"][0]
        self.assertEqual(len(first["candidates"]), 2)
        for candidate in first["candidates"]:
            self.assertEqual(candidate["cause"], "channel_permutation")
            self.assertAlmostEqual(candidate["probability"], 0.5, delta=0.01)
        orders = [c["parameters"]["order"]["value"] for c in first["candidates"]]
        self.assertCountEqual(orders, [exchanged, mirrored])
        self.assertEqual(orders[0], first["parameters"]["order"]["value"])
        self.assertIn("reflector", first["experiment"])

    def test_leakage_at_one_pose(self):
        findings, truth = self.found(325, {"tx_rx_leakage": {"range_m": 0.08, "level_db": 3.0}}, poses=1)
        self.assertEqual(causes(findings), ["tx_rx_leakage"])
        self.assertAlmostEqual(parameter(findings, "tx_rx_leakage", "range_m"), truth["range_m"], delta=0.01)


if __name__ == "__main__":
    unittest.main()
