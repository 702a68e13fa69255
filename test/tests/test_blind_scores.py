"""The blind protocol's scores of trials and its table, with binomial bounds."""
import math
import unittest
from xml.etree import ElementTree

import numpy as np

from mmradartwin_tests import effects
from mmradartwin_tests.blind import draws, table, trials
from mmradartwin_tests.blind.ledger import Ledger
from mmradartwin_tests.blind.scoring import score
from mmradartwin_tests.session import Measurement, Settings
from in_folder import InFolder


def finding(cause, candidates=None, **parameters):
    """A finding as diagnose writes it."""
    return {"cause": cause, "parameters": parameters, "where": [],
            "candidates": [{"cause": c, "probability": p} for c, p in (candidates or [(cause, 1.0)])]}


def number(value, low=None, high=None):
    """A parameter of a finding."""
    return {"value": value, "unit": "m"} if low is None else {"value": value, "unit": "m", "ci95": [low, high]}


BIAS = {"cause": "range_bias", "parameters": {"range_m": 0.03}}
YAW = {"cause": "radar_yaw_offset", "parameters": {"yaw_deg": 2.0}}


class Scoring(unittest.TestCase):
    def test_right_wrong_and_none(self):
        s = score("single", [BIAS], [finding("range_bias")])
        self.assertEqual((s["first"], s["wrong"], s["in_group"], s["group_size"]), (True, False, True, 1))
        s = score("single", [BIAS], [finding("range_scale")])
        self.assertEqual((s["first"], s["wrong"], s["in_group"]), (False, True, False))
        s = score("single", [BIAS], [])
        self.assertEqual((s["first"], s["wrong"], s["in_group"], s["group_size"]), (False, False, False, None))
        s = score("single", [BIAS], [finding("unknown")])
        self.assertEqual((s["first"], s["wrong"], s["in_group"]), (False, False, False))

    def test_right_but_second(self):
        s = score("single", [BIAS], [finding("range_scale"), finding("range_bias")])
        self.assertEqual((s["first"], s["wrong"], s["named"]), (False, True, [True]))

    def test_a_group_that_holds_the_truth_is_not_wrong(self):
        s = score("single", [BIAS], [finding("range_scale", [("range_scale", 0.6), ("range_bias", 0.4)])])
        self.assertEqual((s["first"], s["wrong"], s["in_group"], s["group_size"]), (False, False, True, 2))

    def test_a_doubtful_name_is_not_said_with_confidence(self):
        names = [("range_scale", 0.4), ("if_highpass", 0.35), ("gain_drift", 0.25)]
        self.assertFalse(score("single", [BIAS], [finding("range_scale", names)])["wrong"])

    def test_of_one_cause_for_two_things_each_finding_answers_one(self):
        truths = [{"cause": "actor_absent", "parameters": {"actor": a}} for a in ("tv", "pillar")]
        tv, pillar, wardrobe = (finding("actor_absent", actor={"value": a}) for a in ("tv", "pillar", "wardrobe"))
        s = score("twice", truths, [pillar, tv])
        self.assertTrue(s["told_apart"])
        self.assertFalse(s["wrong"])
        self.assertFalse(score("twice", truths, [tv])["told_apart"])
        self.assertFalse(score("twice", truths, [tv, wardrobe])["told_apart"])
        self.assertTrue(score("twice", truths, [tv, wardrobe, pillar])["wrong"])
        self.assertTrue(score("single", truths[:1], [tv, pillar])["wrong"], msg="one more than there is")
        objects = [{"cause": "actor_unmodelled", "parameters": {"x_m": x, "y_m": 1.0}} for x in (1.0, 3.0)]
        near, far = (dict(finding("actor_unmodelled"), mechanism={"actor_unmodelled": {"x_m": x, "y_m": 1.1}})
                     for x in (1.1, 3.1))
        self.assertTrue(score("twice", objects, [far, near])["told_apart"])
        self.assertFalse(score("twice", objects, [far, dict(far)])["told_apart"])

    def test_reversed_channels_have_two_names(self):
        truth = {"cause": "channel_permutation", "parameters": {"order": [7, 6, 5, 4, 3, 2, 1, 0]}}
        self.assertTrue(score("single", [truth], [finding("channel_conjugation")])["first"])
        truth["parameters"]["order"] = [1, 0, 2, 3, 5, 4, 6, 7]
        self.assertFalse(score("single", [truth], [finding("channel_conjugation")])["first"])
        truth = {"cause": "channel_conjugation", "parameters": {}}
        self.assertTrue(score("single", [truth], [finding("channel_permutation")])["first"])

    def test_of_a_pair_each_cause_is_scored_and_a_third_is_wrong(self):
        s = score("pair", [BIAS, YAW], [finding("radar_yaw_offset"), finding("range_bias")])
        self.assertEqual((s["named"], s["wrong"]), ([True, True], False))
        s = score("pair", [BIAS, YAW], [finding("radar_yaw_offset"), finding("if_lowpass")])
        self.assertEqual((s["named"], s["wrong"]), ([False, True], True))

    def test_outside_the_catalogue(self):
        truth = {"cause": "damp_spot", "parameters": {"variable": "place", "x_m": 4.0, "y_m": 2.0}}
        unknown = {**finding("unknown"), "description": "gain changes with the place", "where": [{"x_m": 4.1,
                                                                                                   "y_m": 2.2}]}
        s = score("outside", [truth], [unknown])
        self.assertEqual((s["unknown"], s["variable"], s["place"], s["wrong"]), (True, True, True, False))
        unknown["where"] = [{"x_m": 4.3, "y_m": 2.2}]
        self.assertFalse(score("outside", [truth], [unknown])["place"])
        s = score("outside", [truth], [finding("actor_absent")])
        self.assertEqual((s["unknown"], s["variable"], s["place"], s["wrong"]), (False, False, False, True))

    def test_the_variable_is_that_of_the_law(self):
        truth = {"cause": "radome_ripple", "parameters": {"variable": "azimuth"}}
        law = {**finding("unknown"), "description": "over azimuth",
               "mechanism": {"empirical_law": {"variable": "range_m", "at": [1, 2], "gain_db": [0, 1]}}}
        self.assertFalse(score("outside", [truth], [law])["variable"])
        law["mechanism"]["empirical_law"]["variable"] = "azimuth_deg"
        self.assertTrue(score("outside", [truth], [law])["variable"])

    def test_every_effect_outside_has_a_variable_that_scoring_knows(self):
        for i in range(len(draws.OUTSIDE)):
            made = effects.make_effect(*draws.draw(draws.Trial("outside", "clean", 2, i))[0])
            measurement = Measurement(Settings(output="", seed=1, poses=2, frames=2, jobs=1, effects=[made]))
            truth = {"cause": made.name, "parameters": made.truth(measurement)}
            self.assertFalse(score("outside", [truth], [])["unknown"], msg=made.name)

    def test_a_decoy_called_a_material_is_blamed(self):
        truth = {"cause": "window_mismatch", "parameters": {}}
        for cause, blamed in (("material_reflectivity", True), ("surface_roughness", True), ("if_highpass", False)):
            self.assertEqual(score("decoy", [truth], [finding(cause)])["material_blamed"], blamed)

    def test_intervals_and_quantiles(self):
        s = score("single", [BIAS], [finding("range_bias", range_m=number(0.04, 0.03, 0.05))])
        ((name, covered, quantile),) = s["coverage"]
        self.assertEqual((name, covered), ("range_bias.range_m", True))
        self.assertAlmostEqual(quantile, 0.025, places=9)
        s = score("single", [BIAS], [finding("range_bias", range_m=number(0.04, 0.0301, 0.05))])
        self.assertFalse(s["coverage"][0][1])
        self.assertEqual(score("single", [BIAS], [finding("range_bias", range_m=number(0.04))])["coverage"], [])

    def test_a_reference_channel_has_no_interval(self):
        truth = {"cause": "channel_phase_error", "parameters": {"phase_deg": [0.0, 5.0, 9.0]}}
        found = {"value": [0.0, 5.5, 8.0], "ci95": [[0, 0], [4, 7], [7, 8.5]]}
        s = score("single", [truth], [finding("channel_phase_error", phase_deg=found)])
        self.assertEqual([c[1] for c in s["coverage"]], [True, False])

    def test_a_right_cause_of_the_wrong_subject_is_told(self):
        truth = {"cause": "wall_ghost", "parameters": {"walls": ["a", "b"]}}
        right = finding("wall_ghost", walls={"value": ["b", "a"]})
        self.assertEqual(score("single", [truth], [right])["subjects"], [True])
        truth = {"cause": "actor_absent", "parameters": {"actor": "tv"}}
        self.assertEqual(score("single", [truth], [finding("actor_absent", actor={"value": "sofa"})])["subjects"],
                         [False])
        truth = {"cause": "channel_permutation", "parameters": {"order": [1, 0]}}
        wrong = finding("channel_permutation", order={"value": [0, 1]})
        self.assertEqual(score("single", [truth], [wrong])["subjects"], [False])


class Table(InFolder):
    def test_bounds_leave_a_fortieth_on_either_side(self):
        def at_most(k, n, p):
            return sum(math.comb(n, i) * p**i * (1 - p)**(n - i) for i in range(k + 1))
        for k, n in ((1, 7), (50, 100), (99, 100), (3, 300)):
            low, high = table.bounds(k, n)
            self.assertAlmostEqual(at_most(k, n, high), 0.025, places=9)
            self.assertAlmostEqual(1 - at_most(k - 1, n, low), 0.025, places=9)
        self.assertEqual(table.bounds(0, 100)[0], 0.0)
        self.assertAlmostEqual(table.bounds(0, 100)[1], 1 - 0.025**0.01, places=12)
        self.assertEqual(table.bounds(8, 8)[1], 1.0)

    def scores(self, rows):
        """Of (row, truths, findings, status)."""
        ledger, records = Ledger(self.folder), []
        for i, (row, truths, findings, status) in enumerate(rows):
            ledger.seal(str(i), {"effects": truths})
            records.append({"key": str(i), "row": row, "findings": findings, "status": status, "seconds": 10.0 + i,
                            "cpu_s": 8.0 + i, "peak_mib": 100.0})
        return table.Scores(records, ledger)

    def measured(self, scores):
        return {row[0]: row[2:] for row in scores.table()}

    def test_shares_count_finished_sessions_with_their_intervals(self):
        told = self.measured(self.scores([
            ("clean", [], [], "ok"), ("clean", [], [finding("range_bias")], "ok"), ("clean", [], [], "timeout"),
            ("single", [BIAS], [finding("range_bias")], "ok"), ("single", [BIAS], [finding("range_scale")], "ok"),
            ("single", [YAW], [], "failed"),
            ("pair", [BIAS, YAW], [finding("range_bias")], "ok")]))
        self.assertEqual(told["false alarms on clean sessions"], ("50.0 % (1.3 to 98.7)", 2))
        self.assertEqual(told["single effects: right name first"][1], 3)
        self.assertTrue(told["single effects: right name first"][0].startswith("33.3 %"))
        self.assertTrue(told["single effects: wrong with confidence"][0].startswith("33.3 %"))
        self.assertEqual(told["pairs: both named"][0], "0.0 % (0.0 to 97.5)")
        self.assertTrue(told["pairs: one right and none wrong"][0].startswith("100.0 %"))
        self.assertEqual(told["no answer (failed or over the time limit)"], ("2", 7))
        self.assertEqual(told["decoys: material blamed"], ("not run", 0))
        self.assertEqual(told["wall time of one diagnosis, median and longest"], ("13 s, 16 s", 7))
        self.assertEqual(told["CPU time of one diagnosis, median and longest"], ("11 s, 14 s", 7))

    def test_what_names_are_worth_where_nothing_is_hidden(self):
        with open(self.at("tried.csv"), "w", encoding="utf-8") as out:
            out.write("round,hypothesis,promised_nats,gain_nats,gain_without_best_place_nats,inflation,verdict\n"
                      '0,"actor_unmodelled, at 1.0, 2.0 m",5,60,40,2,"no larger than clutter is"\n'
                      '0,"actor_unmodelled, a box at 1.0, 2.0 m",5,60,45,1.5,""\n'
                      '0,"echo_replica of sofa",9,30,-7,1,""\n0,"range_bias",-1,,,,""\n')
        most = trials.most_nats(self.at("tried.csv"))
        self.assertEqual(most, {"actor_unmodelled": 30.0, "echo_replica": -7.0})
        scores = self.scores([("clean", [], [], "ok")] * 2)
        for (record, _, _), nats in zip(scores.rows["clean"], (most, {"actor_unmodelled": 12.5}), strict=True):
            record["most_nats"] = nats
        self.assertEqual(scores.by_name_where_nothing_is(), [("actor_unmodelled", "2", "30.0", "0"),
                                                             ("echo_replica", "1", "-7.0", "0")])

    def test_strength_is_told_in_limits_of_the_matched_test(self):
        def strength(nats):
            return table.strength_over_limit({"told": {"nats": nats, "nats_ci95": [0, nats], "explained_power": 0.1}})
        self.assertIsNone(table.strength_over_limit({}))
        self.assertIsNone(table.strength_over_limit({"told": None}))
        self.assertAlmostEqual(strength(4 * table.MATCHED_NATS), 2)
        self.assertEqual(strength(-3.0), 0)

    def test_the_limit_by_chance_is_where_an_exponential_tail_reaches_the_level(self):
        rng = np.random.default_rng(8)
        for mean in (1.0, 4.0):
            nats = np.concatenate([rng.exponential(mean, 1000), -rng.exponential(500, 1000)])
            expected = mean * math.log(0.5 / table.MATCHED_LEVEL)
            self.assertLess(abs(table.limit_by_chance(list(nats)) / expected - 1), 0.2)
        self.assertIsNone(table.limit_by_chance([1.0] * 99))

    def test_strength_is_told_in_the_limit_that_absent_effects_set(self):
        told = self.measured(self.scores([("clean", [], [], "ok")]))
        row, = [name for name in told if "which are not there" in name]
        self.assertTrue(row.endswith("none of fewer than 100"), msg=row)
        self.assertEqual(told[row], ("not run", 0))
        rng, rows = np.random.default_rng(9), [("clean", [], [], "ok")] * 50
        strengths = np.exp(rng.uniform(-2, 2, 200))
        named = rng.random(200) < 1 / (1 + (1.4 / strengths) ** 4)
        scores = self.scores(rows + [("faint", [BIAS], [finding("range_bias")] * int(n), "ok") for n in named])
        for record, _, _ in scores.rows["clean"]:
            record["told_absent"] = [{"cause": "range_bias", "nats": v} for v in rng.exponential(4.0, 8)]
        limit = table.limit_by_chance([a["nats"] for r, _, _ in scores.rows["clean"] for a in r["told_absent"]])
        for (record, _, _), strength in zip(scores.rows["faint"], strengths, strict=True):
            nats = strength ** 2 * limit
            record["told"] = {"nats": nats, "nats_ci95": [nats, nats], "explained_power": 0.1}
        told = self.measured(scores)
        row, = [name for name in told if "which are not there" in name]
        self.assertIn("400 effects", row)
        self.assertIn(f"{limit:.1f} nats", row)
        self.assertEqual(told[row][1], 200)
        self.assertLess(abs(float(told[row][0].split()[0]) - 1.4), 0.25)

    def test_what_moves_echoes_and_what_does_not_have_limits_of_their_own(self):
        scores = self.scores([("clean", [], [], "ok")] * 50)
        rng = np.random.default_rng(10)
        for record, _, _ in scores.rows["clean"]:
            record["told_absent"] = [
                {"cause": cause, "nats": v} for cause, mean in (("scene_registration", 20.0), ("edge_diffraction", 2.0),
                                                                ("element_pattern", 0.1)) for v in
                rng.exponential(mean, 4)]
        limits, absent = scores.limits_by_chance()
        self.assertEqual(absent, 600)
        self.assertGreater(limits["what moves echoes"], 100)
        self.assertLess(limits["what does not"], 40)
        for record, _, _ in scores.rows["clean"]:
            record["told_absent"] = [{"cause": "element_pattern", "nats": -5.0}] * 3
        self.assertEqual(scores.limits_by_chance()[0], {"what does not": table.MATCHED_NATS})

    def test_strength_can_do_without_what_the_likelihood_scatters_over_places(self):
        def strength(nats, deviation):
            between = [nats - 1.96 * deviation, nats + 1.96 * deviation]
            told = {"nats": nats, "nats_ci95": between, "explained_power": 0.1}
            return table.strength_over_limit({"told": told}, at_its_word=False)
        nats = 4 * table.MATCHED_NATS
        as_it_would_be = math.sqrt(2 * nats)
        self.assertAlmostEqual(strength(nats, as_it_would_be), 2, places=3)
        self.assertAlmostEqual(strength(nats, 0.3 * as_it_would_be), 2)
        self.assertAlmostEqual(strength(nats, 3 * as_it_would_be), 2 / 3, places=3)
        self.assertEqual(strength(-3.0, 5.0), 0)

    def test_the_strength_of_half_power_is_the_one_that_draws_were_made_by(self):
        rng = np.random.default_rng(4)
        strengths = np.exp(rng.uniform(-2, 2, 300))
        named = rng.random(300) < 1 / (1 + (1.4 / strengths) ** 4)
        half, low, high = table.half_power(strengths, named)
        self.assertLess(abs(half - 1.4), 0.2)
        self.assertLess(low, half)
        self.assertLess(half, high)
        self.assertLess(high / low, 1.5)
        self.assertIsNone(table.half_power(strengths, [True] * 300))
        self.assertIsNone(table.half_power(strengths[:15], named[:15]))

    def test_effects_of_twice_their_limit_are_a_row_of_their_own(self):
        ledger, records = Ledger(self.folder), []
        for i, (nats, cause) in enumerate(((400.0, "range_bias"), (400.0, "range_scale"), (5.0, "range_scale"),
                                           (None, "range_bias"))):
            ledger.seal(str(i), {"effects": [BIAS]})
            told = None if nats is None else {"nats": nats, "nats_ci95": [nats, nats], "explained_power": 0.1}
            records.append({"key": str(i), "row": "single", "findings": [finding(cause)], "status": "ok", "seconds": 1.0,
                            "cpu_s": 1.0, "peak_mib": 1.0, "told": told})
        told = self.measured(table.Scores(records, ledger))
        self.assertEqual(told["single effects: right name first"][1], 4)
        self.assertEqual(told["– of those of at least twice their detection limit"][1], 3)   # one cannot be told
        self.assertTrue(told["– of those of at least twice their detection limit"][0].startswith("66.7 %"))

    def test_causes_by_name(self):
        rows = self.scores([("single", [BIAS], [finding("range_bias")], "ok"),
                            ("single", [BIAS], [finding("unknown")], "ok"),
                            ("single", [BIAS], [], "ok")]).by_cause()
        self.assertEqual(rows[0][:3], ("single", "range_bias", "1 of 3"))
        self.assertEqual(sorted(rows[0][3].split(", ")), ["nothing", "range_bias", "unknown"])

    def test_the_plot_is_xml_with_a_line_per_parameter(self):
        coverage = [("a.b", True, i / 10) for i in range(10)] + [("c.d", True, 0.5)] * 4
        root = ElementTree.fromstring(table.quantile_plot(coverage))
        lines = root.findall(".//{http://www.w3.org/2000/svg}polyline")
        self.assertEqual([len(line.get("points").split()) for line in lines], [10, 14])    # c.d is too few


if __name__ == "__main__":
    unittest.main()
