"""Hides effects in measured sessions and requires the diagnosis to find them, or nothing where nothing is hidden."""
import csv
import json
import math
import os
import shutil
import unittest

import yaml

from mmradartwin_tests import effects
from mmradartwin_tests.blind import draws, trials
from mmradartwin_tests.session import Measurement, Settings
from chosen_sessions import NOT_TAKEN, every_run, is_taken
from diagnose_program import PROGRAM, diagnose
from in_folder import InFolder


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class HiddenEffects(InFolder):
    """24 poses at nine places, or 17 with two headings at most, 20 frames each: the smallest campaign that tells laws
    over angle from materials.

    MMRADARTWIN_DIAGNOSIS_SEED gives other sessions than the usual ones. A usual run takes what every_run marks.
    """

    def setUp(self):
        super().setUp()
        if not is_taken(self._testMethodName, hasattr(getattr(self, self._testMethodName), "in_every_run")):
            self.skipTest(NOT_TAKEN)

    def measured(self, seed, hidden, headings=7, strength=None, tier="default"):
        """Writes a session with these effects, {name: parameters} or pairs of both; the truth stays outside of it."""
        named = hidden.items() if isinstance(hidden, dict) else hidden
        chosen = [effects.make_effect(name, values, strength) for name, values in named]
        Measurement(Settings(output=self.at("session"), seed=seed, poses=24, headings=headings, frames=20, tier=tier,
                             effects=chosen, truth=self.at("truth.json"))).run()
        with open(self.at("truth.json"), encoding="utf-8") as text:
            return json.load(text)["effects"]

    def write_twin(self, mechanisms):
        """twin.yaml beside the session: its scene, the base and these mechanisms."""
        with open(self.at("twin.yaml"), "w", encoding="ascii") as out:
            yaml.safe_dump({"scene": self.at("session/scene.yaml"), "mechanisms": {**effects.BASE, **mechanisms}}, out)

    def found(self, seed, hidden, headings=7, tier="default", options=("--findings", "1")):
        """First finding of a session that hides the effects, and their true parameters."""
        truth = self.measured(seed, hidden, headings, tier=tier)
        status, findings, errors = diagnose(self.at("session"), self.at("out"), *options)
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual(findings["verdict"], "named", msg=f"seed {seed}: {findings}")
        first = findings["findings"][0]
        self.assertEqual(first["cause"], truth[0]["cause"], msg=f"seed {seed}")
        return findings, first, truth[0]["parameters"]

    @every_run
    def test_an_element_pattern_is_named_and_its_gain_is_real(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "31"))
        findings, first, truth = self.found(seed, {"element_pattern": {}})
        self.assertEqual(first["class"], "C3")
        self.assertAlmostEqual(first["parameters"]["cos_exponent"]["value"], truth["cos_exponent"], delta=0.6,
                               msg=f"seed {seed}")
        gain = first["gain"]["explained_power"]
        self.assertGreater(gain["difference_ci95"][0], 0, msg=f"seed {seed}")
        with open(self.at(os.path.join("out", findings["extended_twin"])), encoding="utf-8") as text:
            extended = yaml.safe_load(text)
        self.assertAlmostEqual(extended["mechanisms"]["element_pattern"]["cos_exponent"],
                               first["parameters"]["cos_exponent"]["value"], places=6)
        # The extended twin makes the same channels likelier by what the finding says, but for later fits of the latents.
        told, = trials.told(PROGRAM, self.at("session"), [{"cause": "element_pattern", "parameters": {
            "cos_exponent": first["parameters"]["cos_exponent"]["value"]}}], self.folder, 300, 2)
        self.assertIsNotNone(told, msg=f"seed {seed}")
        self.assertAlmostEqual(told["nats"] / first["evidence"]["log_likelihood_gain"], 1, delta=0.05)
        self.assertLess(told["nats_ci95"][0], told["nats"])
        self.assertGreater(told["nats_ci95"][1], told["nats"])
        self.assertAlmostEqual(told["explained_power"], gain["after"] - gain["before"], delta=0.02)
        self.assert_the_rest_is_told(first)

    def assert_the_rest_is_told(self, first):
        """Of an element pattern: intervals of the paper's metrics, the cells that carry it, the paths it changes."""
        for metric in (first["gain"]["recall"], first["gain"]["q1"], first["gain"]["q2"],
                       first["gain"]["q3_median_db"], first["gain"]["classes"]["C2"]):
            low, high = metric["difference_ci95"]
            self.assertLessEqual(low, metric["after"] - metric["before"])
            self.assertGreaterEqual(high, metric["after"] - metric["before"])
        place = first["where"][0]
        self.assertLess(place["range_m"][0], place["range_m"][1])
        # Beside boresight, on both sides of it, and nowhere beyond the evaluated field.
        self.assertTrue(-60 <= place["azimuth_deg"][0] < -20 and 20 < place["azimuth_deg"][1] <= 60, msg=place)
        exponent = first["parameters"]["cos_exponent"]["value"]
        with open(self.at("out/records/element_pattern.csv"), encoding="utf-8") as text:
            records = list(csv.DictReader(text))
        specular = [r for r in records if r["event"] == "specular"]
        self.assertGreater(len(specular), 3)
        self.assertEqual({r["pose"] for r in records}, set(place["poses"]))
        one_bounce = [r for r in specular if ";" not in r["actors"]]
        for r in one_bounce:  # there and back the same way: n times 20 lg cos in amplitude squared
            wanted_db = exponent * 20 * math.log10(math.cos(math.radians(float(r["azimuth_after_deg"]))))
            self.assertAlmostEqual(float(r["amplitude_after_db"]) - float(r["amplitude_before_db"]), wanted_db, delta=0.2)
        self.assertTrue(one_bounce)

    def test_leakage_is_named_with_place_and_level(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "32"))
        _, first, truth = self.found(seed, {"tx_rx_leakage": {}})
        self.assertAlmostEqual(first["parameters"]["range_m"]["value"], truth["range_m"], delta=0.02,
                               msg=f"seed {seed}")
        # Over the strongest echo, whose own level is known to an actor's error: the interval says so.
        level = first["parameters"]["level_db"]
        self.assertAlmostEqual(level["value"], truth["level_db"], delta=1.2, msg=f"seed {seed}")
        self.assertLess(level["ci95"][0], truth["level_db"], msg=f"seed {seed}")
        self.assertGreater(level["ci95"][1], truth["level_db"], msg=f"seed {seed}")

    def test_images_are_measured_against_their_hosts(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "1"))
        _, first, truth = self.found(seed, {"iq_imbalance": {"image_db": -29.0}}, headings=2)
        image = first["parameters"]["image_db"]
        self.assertAlmostEqual(image["value"], truth["image_db"], delta=0.15, msg=f"seed {seed}")
        self.assertLess(image["ci95"][1] - image["ci95"][0], 0.5, msg=f"seed {seed}")

    def test_every_order_that_exchanged_lanes_make_is_read(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "2"))
        for lanes in ([2, 3, 0, 1], [1, 0, 3, 2], [2, 0, 3, 1]):
            order = lanes + [4 + lane for lane in lanes]
            Measurement(Settings(output=self.at("session"), seed=seed, poses=16, locations=8, headings=2, frames=5,
                                 effects=[effects.make_effect("channel_permutation", {"order": order}, None)])).run()
            status, findings, errors = diagnose(self.at("session"), self.at("out"), "--findings", "1")
            self.assertEqual(status, 0, msg=errors)
            first = findings["findings"][0]
            self.assertEqual(first["cause"], "channel_permutation", msg=f"seed {seed}, {order}")
            self.assertEqual(first["parameters"]["order"]["value"], order, msg=f"seed {seed}")
            self.assertGreater(first["evidence"]["margin"], 100, msg=f"seed {seed}, {order}")
            shutil.rmtree(self.at("session"))

    def test_a_scene_is_found_and_its_intervals_know_what_actors_and_headings_hide(self):
        # Range errors of 2 cm an actor and heading errors of 0.3 deg a pose: nobody knows its place to a millimetre.
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "35"))
        _, first, truth = self.found(seed, {"scene_registration": {"x_m": 0.06, "y_m": -0.04}})
        for name in ("x_m", "y_m"):
            self.assertAlmostEqual(first["parameters"][name]["value"], truth[name], delta=0.01, msg=f"seed {seed}")
            low, high = first["parameters"][name]["ci95"]
            self.assertGreater(high - low, 0.004, msg=f"seed {seed}: {name}")
            self.assertLess(high - low, 0.1, msg=f"seed {seed}: {name}")

    @every_run
    def test_a_law_without_a_name_is_unknown_and_its_variable_is_found(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "36"))
        self.measured(seed, {"range_ripple": {}}, headings=2, strength=1.3)
        status, findings, errors = diagnose(self.at("session"), self.at("out"))
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual(findings["verdict"], "unknown", msg=f"seed {seed}: {findings}")
        first = findings["findings"][0]
        self.assertEqual(first["cause"], "unknown")
        law = first["mechanism"]["empirical_law"]
        self.assertEqual(law["variable"], "range_m", msg=f"seed {seed}")
        swing_db = max(law["gain_db"]) - min(law["gain_db"])
        self.assertTrue(4 < swing_db < 12, msg=f"seed {seed}: {swing_db} dB of 7.8")
        self.assertGreater(first["gain"]["explained_power"]["difference_ci95"][0], 0, msg=f"seed {seed}")

    def test_a_replica_behind_every_echo_is_unknown_and_its_distance_is_found(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "38"))
        self.measured(seed, {"trailing_echo": {"delay_m": 0.7}}, headings=2, strength=1.3)
        status, findings, errors = diagnose(self.at("session"), self.at("out"))
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual([f["cause"] for f in findings["findings"]], ["unknown"], msg=f"seed {seed}")
        first = findings["findings"][0]
        self.assertAlmostEqual(first["mechanism"]["echo_replica"]["behind_m"], 0.7, delta=0.05, msg=f"seed {seed}")
        self.assertGreater(first["gain"]["explained_power"]["difference_ci95"][0], 0, msg=f"seed {seed}")

    def test_a_second_face_half_a_bin_behind_a_wall_is_unknown(self):
        # It widens the echoes of one actor, which maps do not show and no bin tells by itself.
        truth = trials.hide(draws.Trial("outside", "office", 161, 1, poses=24), self.at("session"))
        self.assertEqual(truth[0]["cause"], "layered_panel")
        status, findings, errors = diagnose(self.at("session"), self.at("out"))
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual([f["cause"] for f in findings["findings"]], ["unknown"], msg=str(findings))
        told, hidden = findings["findings"][0]["mechanism"]["echo_replica"], truth[0]["parameters"]
        self.assertEqual(told["actor"], hidden["actor"])
        self.assertAlmostEqual(told["behind_m"], hidden["depth_m"], delta=0.02)
        self.assertAlmostEqual(told["level_db"], 20 * math.log10(hidden["level"]), delta=3)
        place, = findings["findings"][0]["where"]
        self.assertLess(math.dist((place["x_m"], place["y_m"]), (hidden["x_m"], hidden["y_m"])), 0.3)

    def unknown(self, seed, hidden, strength=None):
        """The mechanism of the one finding, `unknown`, of a session that hides an effect of no name, and the truth."""
        truth = self.measured(seed, hidden, headings=2, strength=strength)
        status, findings, errors = diagnose(self.at("session"), self.at("out"))
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual([f["cause"] for f in findings["findings"]], ["unknown"], msg=f"seed {seed}: {findings}")
        return findings["findings"][0]["mechanism"], truth[0]["parameters"]

    @every_run
    def test_a_tag_that_answers_late_is_unknown_and_placed(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "41"))
        mechanism, truth = self.unknown(seed, {"late_tag": {}})
        echo = mechanism["empirical_echo"]
        self.assertLess(math.dist((echo["x_m"], echo["y_m"]), (truth["x_m"], truth["y_m"])), 0.1, msg=f"seed {seed}")
        self.assertAlmostEqual(echo["behind_m"], truth["late_m"], delta=0.1, msg=f"seed {seed}")  # half a bin
        self.assertAlmostEqual(echo["rcs_dbsm"], 10 * math.log10(truth["rcs_m2"]), delta=2.5, msg=f"seed {seed}")

    def test_a_level_that_goes_with_where_the_radar_stands_is_unknown(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "42"))
        mechanism, truth = self.unknown(seed, {"standing_field": {}}, strength=1.4)
        law = mechanism["empirical_law"]
        self.assertEqual(law["variable"], "standing_m", msg=f"seed {seed}")
        apart_deg = (law["bearing_deg"] - truth["toward_deg"] + 90) % 180 - 90
        self.assertAlmostEqual(apart_deg, 0, delta=15, msg=f"seed {seed}")
        swing_db = max(law["gain_db"]) - min(law["gain_db"])
        self.assertAlmostEqual(swing_db, 2 * truth["swing_db"], delta=3, msg=f"seed {seed}")

    def test_an_array_that_looks_aside_until_it_is_warm_is_unknown(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "44"))
        mechanism, truth = self.unknown(seed, {"warm_up_squint": {}})
        law = mechanism["empirical_law"]
        self.assertEqual(law["variable"], "time_s", msg=f"seed {seed}")
        self.assertAlmostEqual(law["angle_deg"][0] - law["angle_deg"][-1], truth["squint_deg"], delta=1,
                               msg=f"seed {seed}")

    def test_a_transmitter_whose_phase_goes_with_range_is_unknown(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "45"))
        # So steep that the phases of far echoes pass 180 degrees.
        mechanism, truth = self.unknown(seed, {"transmitter_skew": {"deg_per_m": 20.0}})
        law = mechanism["empirical_law"]
        self.assertEqual((law["variable"], law["channels"]), ("range_m", [4, 5, 6, 7]), msg=f"seed {seed}")
        slope = (law["phase_deg"][-1] - law["phase_deg"][0]) / (law["at"][-1] - law["at"][0])
        self.assertAlmostEqual(slope, truth["deg_per_m"], delta=1, msg=f"seed {seed}")

    def test_a_wall_that_dries_is_unknown(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "46"))
        mechanism, truth = self.unknown(seed, {"drying_wall": {"actor": "wall_west"}}, strength=1.4)
        law = mechanism["empirical_law"]
        self.assertEqual((law["variable"], law["actor"]), ("time_s", truth["actor"]), msg=f"seed {seed}")
        # Some of it may be an error of the wall's level in the twin, and few of its echoes tell the law's form.
        swing_db = law["gain_db"][-1] - law["gain_db"][0]
        self.assertTrue(0.4 < swing_db / truth["rise_db"] < 1.3, msg=f"seed {seed}: {swing_db} dB")

    def test_transmitters_that_are_heard_in_each_others_slots_are_unknown(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "43"))
        mechanism, truth = self.unknown(seed, {"slot_crosstalk": {}})
        coupling = mechanism["transmitter_coupling"]
        share = complex(coupling["share_real"], coupling["share_imaginary"])
        self.assertAlmostEqual(20 * math.log10(abs(share)), truth["level_db"], delta=1, msg=f"seed {seed}")

    def test_a_radar_of_two_states_is_unknown_and_nobody_walks(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "11"))
        self.measured(seed, {"two_states": {}}, headings=2)
        status, findings, errors = diagnose(self.at("session"), self.at("out"))
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual({f["cause"] for f in findings["findings"]}, {"unknown"}, msg=f"seed {seed}: {findings}")
        self.assertIn("from frame to frame", findings["findings"][0]["description"])

    @every_run
    def test_a_gain_that_settles_within_a_pose_is_unknown(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "39"))
        self.measured(seed, {"slow_start": {}}, headings=2)
        status, findings, errors = diagnose(self.at("session"), self.at("out"))
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual([f["cause"] for f in findings["findings"]], ["unknown"], msg=f"seed {seed}")
        first = findings["findings"][0]
        self.assertIn("level of frames", first["description"])
        # Weaker by 10 dB exp(-frame/15).
        gain_db = first["mechanism"]["empirical_frame_gain"]["gain_db"]
        self.assertEqual(len(gain_db), 20, msg=f"seed {seed}")
        self.assertAlmostEqual(gain_db[0] - gain_db[-1], -10 * (1 - math.exp(-19 / 15)), delta=0.3, msg=f"seed {seed}")
        self.assertGreater(first["gain"]["log_likelihood_per_pose"]["difference_ci95"][0], 0, msg=f"seed {seed}")
        with open(self.at("out/twin.extended.yaml"), encoding="ascii") as twin:
            self.assertIn("empirical_frame_gain", twin.read())
        # To a twin that has the term it is no news.
        extended = self.at("out/twin.extended.yaml")
        status, findings, errors = diagnose(self.at("session"), self.at("again"), "--twin", extended)
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual(findings["findings"], [])
        with open(self.at("again/twin.extended.yaml"), encoding="ascii") as twin:
            self.assertEqual(twin.read().count("empirical_frame_gain"), 1)

    def test_a_turned_box_that_the_scene_lacks_is_placed(self):
        # It shines to a few places and hides walls from others; as a cylinder it was refused.
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "91"))
        _, first, truth = self.found(seed, {"actor_unmodelled": {"shape": "box", "size_m": 0.4}}, headings=2)
        mechanism = first["mechanism"]["actor_unmodelled"]
        self.assertEqual(mechanism["shape"], "box", msg=f"seed {seed}")
        for name, delta in (("x_m", 0.1), ("y_m", 0.1), ("size_m", 0.12)):
            self.assertAlmostEqual(mechanism[name], truth[name], delta=delta, msg=f"seed {seed}: {mechanism}")
        turned = (mechanism["yaw_deg"] - truth["yaw_deg"] + 45) % 90 - 45
        self.assertAlmostEqual(turned, 0, delta=3, msg=f"seed {seed}: {mechanism}")

    @every_run
    def test_two_objects_that_the_scene_lacks_are_both_placed(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "92"))
        truth = self.measured(seed, [("actor_unmodelled", {"size_m": 0.4}), ("actor_unmodelled", {"size_m": 0.3})],
                              headings=2)
        status, findings, errors = diagnose(self.at("session"), self.at("out"))
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual([f["cause"] for f in findings["findings"]], ["actor_unmodelled"] * 2, msg=f"seed {seed}")
        places = [(f["mechanism"]["actor_unmodelled"]["x_m"], f["mechanism"]["actor_unmodelled"]["y_m"])
                  for f in findings["findings"]]
        for hidden in truth:
            place = hidden["parameters"]["x_m"], hidden["parameters"]["y_m"]
            self.assertLess(min(math.dist(place, p) for p in places), 0.06, msg=f"seed {seed}: {places}")
        figures = [f["figure"] for f in findings["findings"]]
        self.assertEqual(figures, ["figures/actor_unmodelled.png", "figures/actor_unmodelled_2.png"])
        for figure in figures:
            with open(self.at(os.path.join("out", figure)), "rb") as picture:
                self.assertEqual(picture.read(8), b"\x89PNG\r\n\x1a\n")
        with open(self.at("out/report.html"), encoding="utf-8") as report:
            pictures = report.read().count('src="data:image/png;base64,')
        self.assertEqual(pictures, 2 * 3 + 3 * 5)    # two maps and the room of each finding; five maps of each pose that is shown
        # The twin that it wrote has both, and nothing more is found with it.
        extended = self.at("out/twin.extended.yaml")
        with open(extended, encoding="ascii") as twin:
            self.assertEqual(len(yaml.safe_load(twin)["mechanisms"]["actor_unmodelled"]), 2)
        status, findings, errors = diagnose(self.at("session"), self.at("again"), "--twin", extended)
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual(findings["verdict"], "none", msg=f"seed {seed}: {findings}")

    def test_edges_have_the_level_that_they_were_given(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "77"))
        _, first, truth = self.found(seed, {"edge_diffraction": {"level": 1.9}}, headings=2)
        level = first["parameters"]["level"]
        self.assertAlmostEqual(level["value"], truth["level"], delta=0.45, msg=f"seed {seed}: {level}")

    def test_someone_who_walks_to_and_fro_leaves_no_object(self):
        # Whole walks last 1.5 s: within a pose of one second he turns once or twice.
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "81"))
        findings, first, truth = self.found(seed, {"moving_target": {"speed_m_per_s": 0.8}}, headings=2, options=())
        self.assertEqual([f["cause"] for f in findings["findings"]], ["moving_target"], msg=f"seed {seed}")
        for name, delta in (("x_m", 0.2), ("y_m", 0.2), ("speed_m_per_s", 0.12)):
            self.assertAlmostEqual(first["parameters"][name]["value"], truth[name], delta=delta, msg=f"seed {seed}")

    def test_how_fast_someone_walks_is_told_from_how_often_he_turns(self):
        # At 1 m/s he turns every 0.6 s; most of his ways are across the view.
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "308"))
        _, first, truth = self.found(seed, {"moving_target": {"speed_m_per_s": 1.0}}, headings=2, tier="office")
        self.assertAlmostEqual(first["parameters"]["speed_m_per_s"]["value"], truth["speed_m_per_s"], delta=0.08,
                               msg=f"seed {seed}")

    def test_a_step_of_the_gain_is_a_drift(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "37"))
        _, first, _ = self.found(seed, {"gain_drift": {"steps_db": [-4.0]}}, headings=2)
        steps_db = first["parameters"]["steps_db"]["value"]
        self.assertAlmostEqual(sum(steps_db), -4.0, delta=2.0, msg=f"seed {seed}: {steps_db}")

    def test_steps_of_the_gain_are_found_when_they_happened(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "53"))
        # The campaign lasts some 600 s: neither is at equal parts.
        findings, first, truth = self.found(seed, {"gain_drift": {"steps_db": [-4.0, 6.0], "steps_s": [90.0, 330.0]}},
                                            headings=2, tier="office", options=())
        self.assertEqual([f["cause"] for f in findings["findings"]], ["gain_drift"], msg=f"seed {seed}")
        for told, step in zip(first["parameters"]["steps_db"]["value"], truth["steps_db"], strict=True):
            self.assertAlmostEqual(told, step, delta=1.5, msg=f"seed {seed}")
        for told, time_s in zip(first["mechanism"]["gain_drift"]["steps_s"], truth["steps_s"], strict=True):
            self.assertAlmostEqual(told, time_s, delta=40, msg=f"seed {seed}")

    def test_a_weak_step_of_the_gain_is_seen_from_few_places(self):
        # 3 dB at nine places with all errors of rooms and poses; by the scatter of nine places alone chance made as much
        # once in 60 sessions, against what scatter there usually is once in 10,000.
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "201"))
        _, first, _ = self.found(seed, {"gain_drift": {"steps_db": [-3.0]}}, tier="office")
        steps_db = first["parameters"]["steps_db"]["value"]
        self.assertAlmostEqual(sum(steps_db), -3.0, delta=1.5, msg=f"seed {seed}: {steps_db}")

    def test_roughness_is_told_from_a_darker_material(self):
        # Each of the wood's actors may have a gain of its own instead.
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "42"))
        _, first, truth = self.found(seed, {"surface_roughness": {"material": "Wood", "roughness_rms_m": 4e-4}},
                                     headings=2, tier="clean")
        self.assertEqual(first["parameters"]["material"]["value"], truth["material"], msg=f"seed {seed}")
        self.assertAlmostEqual(first["parameters"]["roughness_rms_m"]["value"], truth["roughness_rms_m"], delta=8e-5,
                               msg=f"seed {seed}")

    @every_run
    def test_a_transmitter_and_a_turned_mount_are_no_error_of_every_channel(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "48"))
        self.measured(seed, {"radar_yaw_offset": {"yaw_deg": 3.0}, "tx_imbalance": {"phase_deg": 20, "gain_db": 1.0}},
                      headings=2)
        status, findings, errors = diagnose(self.at("session"), self.at("out"))
        self.assertEqual(status, 0, msg=errors)
        found = {f["cause"]: f for f in findings["findings"]}
        self.assertEqual(set(found), {"radar_yaw_offset", "tx_imbalance"}, msg=f"seed {seed}")
        self.assertAlmostEqual(found["radar_yaw_offset"]["parameters"]["yaw_deg"]["value"], 3, delta=0.4)
        self.assertAlmostEqual(found["tx_imbalance"]["parameters"]["phase_deg"]["value"], 20, delta=1)
        nats = [f["evidence"]["log_likelihood_gain"] for f in findings["findings"]]
        self.assertEqual(nats, sorted(nats, reverse=True), msg=f"seed {seed}")
        # Each on top of those before it.
        powers = [f["gain"]["explained_power"] for f in findings["findings"]]
        self.assertAlmostEqual(powers[1]["before"], powers[0]["after"], delta=0.01)

    def test_a_corner_that_the_twin_lacks_is_no_move_of_a_few_centimetres(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "50"))
        _, first, truth = self.found(seed, {"corner_reflection": {"actors": "bookshelf;wall_east"}}, headings=2,
                                     tier="office")
        self.assertEqual(set(first["parameters"]["actors"]["value"]), set(truth["actors"]), msg=f"seed {seed}")

    def test_lost_packets_say_what_leaving_them_out_gains(self):
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "49"))
        _, first, _ = self.found(seed, {"packet_loss": {"lost_fraction": 0.05}}, headings=2)
        self.assertGreater(first["gain"]["log_likelihood_per_pose"]["difference_ci95"][0], 0, msg=f"seed {seed}")
        # Five samples of a hundred, whose places differ from frame to frame, hardly show in an average.
        power = first["gain"]["explained_power"]
        self.assertAlmostEqual(power["after"], power["before"], delta=0.01, msg=f"seed {seed}")

    @every_run
    def test_what_the_twin_states_is_fitted_anew(self):
        # As after a calibration, when the mount was bumped: the heading is not what the twin says, the transmitter is.
        seed = int(os.environ.get("MMRADARTWIN_DIAGNOSIS_SEED", "411"))
        self.measured(seed, {"radar_yaw_offset": {"yaw_deg": 3.0}, "tx_imbalance": {"phase_deg": 20, "gain_db": 1}},
                      headings=2, tier="office")
        self.write_twin({"radar_yaw_offset": {"yaw_deg": 1.5}, "tx_imbalance": {"phase_deg": 20, "gain_db": 1}})
        status, findings, errors = diagnose(self.at("session"), self.at("out"), "--twin", self.at("twin.yaml"))
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual([f["cause"] for f in findings["findings"]], ["radar_yaw_offset"], msg=f"seed {seed}")
        yaw = findings["findings"][0]["parameters"]["yaw_deg"]
        self.assertAlmostEqual(yaw["value"], 3.0, delta=0.5, msg=f"seed {seed}")
        self.assertIn("yaw_deg 1.5", findings["findings"][0]["description"])
        with open(self.at("out/twin.extended.yaml"), encoding="ascii") as text:
            extended = yaml.safe_load(text)["mechanisms"]
        self.assertAlmostEqual(extended["radar_yaw_offset"]["yaw_deg"], yaw["value"], delta=0.01)
        self.assertEqual(extended["tx_imbalance"], {"phase_deg": 20, "gain_db": 1})

    def test_errors_that_look_like_a_registration_are_none(self):
        # Here 13 mm of registration let paths through that gain 129 nats and 0.035 of the measured power; actors and
        # poses of this tier have errors of 20 mm and 0.3 deg.
        self.measured(1727862859, {}, headings=2, tier="office")
        status, findings, errors = diagnose(self.at("session"), self.at("out"))
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual(findings["findings"], [])

    @every_run
    def test_nothing_hidden_is_none(self):
        # One seed, so that the one false alarm in a hundred that the threshold allows does not stop everybody's work;
        # many seeds belong to the protocol.
        self.measured(20261, {})
        status, findings, errors = diagnose(self.at("session"), self.at("out"))
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual(findings["verdict"], "none", msg=f"{findings['findings']}")
        self.assertEqual(findings["findings"], [])


if __name__ == "__main__":
    unittest.main()
