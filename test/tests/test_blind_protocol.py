"""The blind protocol itself: sealed truths, resumed trials, scores, bounds; not how well the diagnosis does."""
import hashlib
import json
import math
import os
import signal
import stat
import subprocess
import sys
import tempfile
import time
import unittest
from xml.etree import ElementTree

import numpy as np

from mmradartwin_tests import effects
from mmradartwin_tests.blind import draws, recordings, table, trials
from mmradartwin_tests.blind.ledger import Ledger, LedgerError
from mmradartwin_tests.blind.scoring import score
from mmradartwin_tests.session import Measurement, Settings

HERE = os.path.dirname(os.path.realpath(__file__))
PROTOCOL = os.path.join(HERE, "..", "scripts", "blind_protocol.py")


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def at(self, *names):
        return os.path.join(self.folder, *names)


def change(file, old, new):
    """Replaces text in a file, which has to be there."""
    with open(file, encoding="utf-8") as text:
        content = text.read()
    assert old in content
    with open(file, "w", encoding="utf-8") as out:
        out.write(content.replace(old, new))


class SealedTruths(InFolder):
    def sealed(self):
        ledger = Ledger(self.folder)
        for i in range(3):
            ledger.seal(f"trial-{i}", {"effects": [{"cause": "range_bias", "parameters": {"range_m": 0.03 + i}}]})
        return ledger

    def test_what_was_sealed_is_opened(self):
        self.sealed()
        for i in range(3):
            self.assertEqual(Ledger(self.folder).open(f"trial-{i}")["effects"][0]["parameters"]["range_m"], 0.03 + i)

    def test_the_ledger_holds_the_hash_of_the_file(self):
        ledger = self.sealed()
        with open(ledger.truth_file("trial-1"), "rb") as truth, open(ledger.file, encoding="utf-8") as lines:
            self.assertEqual(json.loads(lines.readlines()[1])["sha256"], hashlib.sha256(truth.read()).hexdigest())

    def test_a_changed_truth_is_refused(self):
        ledger = self.sealed()
        change(ledger.truth_file("trial-1"), "range_bias", "range_scale")
        with self.assertRaisesRegex(LedgerError, "not what was sealed"):
            ledger.open("trial-1")
        ledger.open("trial-2")

    def test_a_missing_truth_is_refused(self):
        ledger = self.sealed()
        os.remove(ledger.truth_file("trial-2"))
        with self.assertRaisesRegex(LedgerError, "is missing"):
            ledger.open("trial-2")
        with self.assertRaisesRegex(LedgerError, "never sealed"):
            ledger.open("trial-3")

    def test_a_truth_and_its_hash_changed_together_are_refused(self):
        ledger = self.sealed()
        change(ledger.truth_file("trial-0"), "range_bias", "range_scale")
        with open(ledger.truth_file("trial-0"), "rb") as truth:
            change(ledger.file, ledger.hashes["trial-0"], hashlib.sha256(truth.read()).hexdigest())
        with self.assertRaisesRegex(LedgerError, "line 2 does not follow"):
            Ledger(self.folder)

    def test_a_line_taken_out_is_refused(self):
        ledger = self.sealed()
        with open(ledger.file, encoding="utf-8") as lines:
            text = lines.readlines()
        with open(ledger.file, "w", encoding="utf-8") as out:
            out.writelines([text[0], text[2]])
        with self.assertRaisesRegex(LedgerError, "line 2"):
            Ledger(self.folder)

    def test_an_interrupted_trial_is_sealed_again_only_with_its_truth(self):
        self.sealed()
        truth = {"effects": [{"cause": "range_bias", "parameters": {"range_m": 1.03}}]}
        Ledger(self.folder).seal("trial-1", truth)
        truth["effects"][0]["parameters"]["range_m"] = 1.04
        with self.assertRaisesRegex(LedgerError, "another truth"):
            Ledger(self.folder).seal("trial-1", truth)
        self.assertEqual(Ledger(self.folder).open("trial-1")["effects"][0]["parameters"]["range_m"], 1.03)

    def test_a_line_that_was_never_finished_is_forgotten(self):
        ledger = self.sealed()
        with open(ledger.file, "ab") as out:
            out.write(b'{"key": "trial-3", "sha')
        Ledger(self.folder).seal("trial-3", {})
        self.assertEqual(len(Ledger(self.folder).hashes), 4)


class KeptResults(InFolder):
    def test_results_outlive_the_process_that_wrote_them(self):
        file = self.at("results.jsonl")
        trials.Results(file).add({"key": "a", "seconds": 1.5})
        with open(file, "ab") as out:
            out.write(b'{"key": "b", "sec')    # power failed here
        again = trials.Results(file)
        self.assertEqual(list(again.records), ["a"])
        again.add({"key": "b", "seconds": 2.5})
        self.assertEqual(trials.Results(file).records["b"]["seconds"], 2.5)

    def test_a_line_that_is_no_result_is_named(self):
        with open(self.at("results.jsonl"), "w", encoding="ascii") as out:
            out.write('{"key": "a"}\n7\n')
        with self.assertRaisesRegex(ValueError, "line 2"):
            trials.Results(self.at("results.jsonl"))


class MeasuredRuns(InFolder):
    def test_memory_of_the_child_alone_and_its_status(self):
        grow = "import sys; b = b'x' * (300 << 20); sys.exit(3)"
        status, seconds, cpu_s, peak_mib = trials.run_measured([sys.executable, "-c", grow], 300, self.at("log"))
        self.assertEqual(status, 3)
        self.assertTrue(0 < cpu_s < seconds + 0.1, msg=(cpu_s, seconds))    # one thread; ticks are 10 ms
        self.assertTrue(300 < peak_mib < 600, msg=peak_mib)
        status, _, _, small_mib = trials.run_measured([sys.executable, "-c", "print('told')"], 300, self.at("log"))
        self.assertEqual(status, 0)
        self.assertLess(small_mib, 200)
        with open(self.at("log"), encoding="ascii") as text:
            self.assertEqual(text.read(), "told\n")

    def test_the_limit_ends_children_too(self):
        script = f"sleep 600 & echo $! > {self.at('pid')}; wait"
        status, *_ = trials.run_measured(["/bin/sh", "-c", script], 2, self.at("log"))
        self.assertIsNone(status)
        with open(self.at("pid"), encoding="ascii") as text:
            pid = int(text.read())
        for _ in range(600):
            try:
                with open(f"/proc/{pid}/stat", encoding="ascii") as text:
                    if text.read().rsplit(")", 1)[1].split()[0] == "Z":
                        return
            except FileNotFoundError:
                return
            time.sleep(0.1)
        self.fail("the grandchild still runs")


ANSWER = {"format": "mmradartwin_findings/1", "verdict": "named", "findings": [
    {"cause": "gain_drift", "parameters": {}, "candidates": [{"cause": "gain_drift", "probability": 1.0}],
     "evidence": {}, "mechanism": None, "where": [{"poses": ["001"], "range_m": [1, 2]}], "gain": None}]}


class WithProgram(InFolder):
    """A small program in place of diagnose: it shows what a diagnosis could see while it runs."""

    def program(self, lines):
        """A shell program that is called as diagnose is: SESSION --output DIR --jobs N."""
        file = self.at("program.sh")
        with open(file, "w", encoding="ascii") as out:
            out.write("#!/bin/sh\nset -e\nsession=$1; output=$3; mkdir -p $output\n" + lines + "\n"
                      f"cat > $output/findings.json <<'EOF'\n{json.dumps(ANSWER)}\nEOF\n")
        os.chmod(file, os.stat(file).st_mode | stat.S_IXUSR)
        return file


class WholeTrials(WithProgram):
    def trial(self, cause="noise_floor"):
        for number in range(1000):
            trial = draws.Trial("single", "office", 5, number, poses=2, frames=2)
            if draws.draw(trial)[0][0] == cause:
                return trial
        self.fail(f"{cause} is never drawn")

    def test_the_truth_is_sealed_before_and_the_session_is_silent_and_gone_afterwards(self):
        trial = self.trial("tx_rx_leakage")
        copy, seen = self.at("copy"), self.at("seen")
        program = self.program(f"cp -r $session {copy}; cat {self.at('ledger.jsonl')} > {seen}; pwd >> {seen}; "
                               f"echo $session >> {seen}")
        ledger = Ledger(self.folder)
        record = trials.run_trial(trial, ledger, program)
        self.assertEqual((record["status"], record["verdict"]), ("ok", "named"))
        self.assertEqual(record["findings"][0]["where"], [{"range_m": [1, 2]}])
        self.assertGreater(record["peak_mib"], 0)
        with open(seen, encoding="utf-8") as text:
            lines = text.read().splitlines()
        self.assertEqual(json.loads(lines[0])["key"], trial.key())
        self.assertFalse(os.path.exists(lines[-1]), "the session is left")
        self.assertNotIn("leak", lines[-1])
        self.assertIn("poses.csv", os.listdir(copy))
        for folder, _, files in os.walk(copy):
            for name in files:
                self.assertNotIn("leak", name)
                with open(os.path.join(folder, name), "rb") as file:
                    self.assertNotIn(b"leak", file.read(), msg=name)
        self.assertEqual(ledger.open(trial.key())["effects"][0]["cause"], "tx_rx_leakage")

    def test_a_program_that_changes_the_truth_gets_no_result(self):
        trial = self.trial()
        program = self.program(f"sed -i s/noise_floor/gain_drift/ {self.at('truth')}/*")
        with self.assertRaisesRegex(LedgerError, "not what was sealed"):
            trials.run_trial(trial, Ledger(self.folder), program)

    def test_failure_and_lateness_are_told(self):
        trial = self.trial()
        record = trials.run_trial(trial, Ledger(self.folder), self.program("echo poses are odd >&2; exit 1"))
        self.assertEqual((record["status"], record["exit"], record["log"]), ("failed", 1, ["poses are odd"]))
        record = trials.run_trial(trial, Ledger(self.folder), self.program("sleep 600"), limit_s=1)
        self.assertEqual((record["status"], record["findings"]), ("timeout", []))


class ProtocolProgram(WithProgram):
    def environment(self, program):
        """Of a process that finds the program where diagnose would be."""
        environment = dict(os.environ)
        if program:
            place = self.at("prefix", "lib", "mmradartwin_attribution")
            os.makedirs(place, exist_ok=True)
            if not os.path.exists(os.path.join(place, "diagnose")):
                os.symlink(program, os.path.join(place, "diagnose"))
            environment["CMAKE_PREFIX_PATH"] = self.at("prefix")
        return environment

    def command(self, *arguments):
        """Of the protocol, on the smallest of sessions."""
        return [sys.executable, PROTOCOL, "--output", self.at("run"), "--poses", "2", "--frames", "2", *arguments]

    def call(self, *arguments, program=None):
        """(exit status, output, errors) of the protocol with a program in place of diagnose."""
        run = subprocess.run(self.command(*arguments), capture_output=True, text=True, check=False,
                             env=self.environment(program))
        return run.returncode, run.stdout, run.stderr

    def test_finished_trials_do_not_run_again(self):
        program = self.program(f"echo run >> {self.at('calls')}")
        arguments = ["--rows", "clean", "--trials", "clean=2", "--seed", "4"]
        status, first, errors = self.call(*arguments, program=program)
        self.assertEqual(status, 0, msg=errors)
        self.assertIn("false alarms on clean sessions | ≤ 1 % | 100.0 % (15.8 to 100.0) | 2 |", first)
        status, second, errors = self.call(*arguments, program=program)
        self.assertEqual(status, 0, msg=errors)
        with open(self.at("calls"), encoding="ascii") as calls:
            self.assertEqual(len(calls.readlines()), 2)
        status, third, errors = self.call("--table")
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual(second, third)
        key = draws.Trial("clean", "office", 4, 1, 2, 2).key()
        change(self.at("run", "truth", key + ".json"), "[]", '["noise_floor"]')
        status, _, errors = self.call("--table")
        self.assertEqual(status, 2)
        self.assertIn("not what was sealed", errors)

    def test_ended_from_outside_it_leaves_nothing_behind(self):
        told = self.at("told")
        program = self.program(f"echo $$ $session > {told}.part; mv {told}.part {told}; exec sleep 600")
        command = self.command("--rows", "clean", "--trials", "clean=1")
        with open(self.at("errors"), "w", encoding="utf-8") as errors, \
                subprocess.Popen(command, stderr=errors, env=self.environment(program)) as run:
            while not os.path.exists(told):
                self.assertIsNone(run.poll(), "it ended by itself")
                time.sleep(0.1)
            run.send_signal(signal.SIGTERM)
            self.assertEqual(run.wait(120), 1)
        with open(told, encoding="utf-8") as text:
            pid, session = text.read().split()
        self.assertFalse(os.path.exists(session))
        self.assertFalse(os.path.exists(f"/proc/{pid}"))
        with open(self.at("errors"), encoding="utf-8") as text:
            self.assertIn("goes on where this one ended", text.read())

    def test_wrong_use_is_told(self):
        for arguments, word in ((["--rows", "singles"], "singles"), (["--trials", "clean=many"], "clean=many"),
                                (["--trials", "all=3"], "all=3")):
            status, _, errors = self.call(*arguments)
            self.assertEqual(status, 2)
            self.assertIn(word, errors)


class Draws(unittest.TestCase):
    def test_absent_effects_are_weak_and_are_told_as_hidden_ones_are(self):
        clean = draws.Trial("clean", "office", 3, 1, poses=2, frames=2)
        drawn = draws.absent(clean)
        self.assertEqual(drawn, draws.absent(clean))
        self.assertEqual(len({name for name, _ in drawn}), draws.ABSENT)
        self.assertEqual(draws.draw(clean), [])
        for name, parameters in drawn:
            truth, = trials.measurement_of(clean, [(name, parameters, None)], None).hidden()
            self.assertEqual(truth["cause"], name)
            self.assertEqual(json.loads(json.dumps(truth["parameters"])), truth["parameters"])
        bias = [abs(p["range_m"]) for i in range(60)
                for name, p in draws.absent(draws.Trial("clean", "office", 3, i)) if name == "range_bias"]
        self.assertTrue(0.0003 <= min(bias) and max(bias) <= 0.03, msg=bias)

    def test_every_effect_of_the_catalogue_is_drawn_once_a_round(self):
        names = [draws.draw(draws.Trial("single", "office", 3, i))[0][0] for i in range(2 * len(draws.SINGLE))]
        half = len(draws.SINGLE)
        self.assertEqual(sorted(names[:half]), sorted(effects.EFFECTS))
        self.assertEqual(sorted(names[half:]), sorted(effects.EFFECTS))
        self.assertNotEqual(names[:half], names[half:])

    def test_draws_repeat_and_differ_by_seed_and_trial(self):
        drawn = [draws.draw(draws.Trial("pair", "office", seed, i)) for seed in (1, 2) for i in range(40)]
        again = [draws.draw(draws.Trial("pair", "office", seed, i)) for seed in (1, 2) for i in range(40)]
        self.assertEqual(drawn, again)
        self.assertGreater(len({json.dumps(d) for d in drawn}), 70)
        seeds = {draws.Trial(row, tier, seed, i).session_seed()
                 for row in draws.ROWS for tier in ("office", "clean") for seed in (1, 2) for i in range(50)}
        self.assertEqual(len(seeds), 4 * len(draws.ROWS) * 50)

    def test_all_that_is_drawn_can_be_hidden(self):
        for row, count in (("single", len(draws.SINGLE)), ("decoy", len(draws.DECOYS)), ("pair", 3),
                           ("twice", len(draws.TWICE)), ("faint", len(draws.FAINT))):
            for i in range(count):
                trial = draws.Trial(row, "clean", 8, i, poses=2, frames=2)
                chosen = [effects.make_effect(*d) for d in draws.draw(trial)]
                measurement = Measurement(Settings(output="", seed=i, poses=2, frames=2, jobs=1, effects=chosen))
                for e in chosen:
                    json.dumps(e.truth(measurement))
                if row == "single" and chosen[0].name == "corner_reflection":
                    self.assertTrue(chosen[0].corners(measurement.room), msg=chosen[0].p)

    def test_permutations_are_orders_and_never_none(self):
        rng = np.random.default_rng(6)
        for _ in range(200):
            order = draws.permutation(rng, None)["order"]
            self.assertEqual(sorted(order), list(range(8)))
            self.assertNotEqual(order, list(range(8)))


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

    def test_pairs(self):
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

    def test_decoys(self):
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

    def test_subjects(self):
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

    def test_counts(self):
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


@unittest.skipIf(recordings.capture_file() is None,
                 "openradar_indoor is not here; set MMRADARTWIN_DATA to the folder with the real recordings")
class RealRecording(InFolder):
    @classmethod
    def setUpClass(cls):
        cls.x = recordings.read_capture()

    def injected(self, name, seed=11):
        data, parameters = recordings.inject(name, np.random.default_rng(seed))
        raw = np.frombuffer(data, "<i2").reshape(128, 2, 128, 2, 4)
        return raw[:, :, :, 0] + 1j * raw[:, :, :, 1], parameters

    def test_the_copy_is_the_recording(self):
        recordings.write_untouched(self.at("s"))
        with open(self.at("s", "captures", "001.bin"), "rb") as copy, open(recordings.capture_file(), "rb") as source:
            content = source.read()
            self.assertEqual(copy.read(), content)
        self.assertEqual(recordings.payload(self.x), content)

    def test_every_session_has_the_same_files_whatever_is_hidden(self):
        names = set()
        for i in range(len(recordings.INJECTIONS)):
            (truth,) = recordings.write_session(draws.Trial("recording", "office", 1, i), self.at(str(i)))
            names.add(truth["cause"])
            self.assertEqual(sorted(os.listdir(self.at(str(i)))), ["captures", "poses.csv", "radar.yaml",
                                                                   "session.yaml"])
            self.assertEqual(os.path.getsize(self.at(str(i), "captures", "001.bin")), 524288)
        self.assertEqual(len(names), len(recordings.INJECTIONS))

    def test_channel_errors_are_those_of_the_truth(self):
        y, truth = self.injected("channel_phase_error")
        for k in range(8):
            a, b = self.x[:, k // 4, :, k % 4].ravel(), y[:, k // 4, :, k % 4].ravel()
            ratio = np.vdot(a, b) / np.vdot(a, a)
            self.assertAlmostEqual(20 * math.log10(abs(ratio)), truth["gain_db"][k], delta=0.01)
            self.assertAlmostEqual((math.degrees(np.angle(ratio)) - truth["phase_deg"][k] + 180) % 360 - 180, 0,
                                   delta=0.1)

    def test_conventions(self):
        np.testing.assert_array_equal(self.injected("iq_conjugation")[0], np.conj(self.x))
        y, _ = self.injected("channel_conjugation")
        for k in range(8):
            np.testing.assert_array_equal(y[:, k // 4, :, k % 4], self.x[:, (7 - k) // 4, :, (7 - k) % 4])

    def test_leakage_is_one_tone_in_every_chirp(self):
        y, truth = self.injected("tx_rx_leakage")
        added = (y - self.x).mean(axis=0)
        t = np.arange(128) / 2.5e6
        tone = np.exp(-2j * np.pi * 60e12 * 2 * truth["range_m"] / 299792458.0 * t)
        vector = (added * tone[:, None]).mean(axis=1)
        np.testing.assert_allclose(added, vector[:, None, :] * tone.conj()[:, None], atol=1.0)    # counts
        level = math.sqrt(np.mean(np.abs(vector)**2)) / recordings.strongest(self.x)
        self.assertAlmostEqual(20 * math.log10(level), truth["level_db"], delta=0.05)

    def test_saturated_share(self):
        y, truth = self.injected("adc_saturation")
        parts = np.concatenate([y.real.ravel(), y.imag.ravel()])
        self.assertAlmostEqual(np.mean(np.abs(parts) >= 32767), truth["clipped_fraction"], delta=2e-4)

    def test_lost_packets(self):
        data, truth = recordings.inject("packet_loss", np.random.default_rng(11))
        with open(recordings.capture_file(), "rb") as source:
            content = source.read()
        lost = [i for i in range(0, len(content), 1456) if not any(data[i:i + 1456])]
        self.assertAlmostEqual(len(lost) / 361, truth["lost_fraction"], places=9)
        for i in range(0, len(content), 1456):
            self.assertTrue(i in lost or data[i:i + 1456] == content[i:i + 1456])

    def test_the_walker_is_where_and_as_fast_as_the_truth_says(self):
        for seed in (11, 12, 13):
            y, truth = self.injected("moving_target", seed)
            added = (y - self.x) * np.hanning(128)[None, None, :, None] * np.hanning(128)[:, None, None, None]
            size = 8 * 128
            spectrum = np.fft.fft2(added[:, 0, :, 0], (size, size))
            doppler, beat = np.unravel_index(np.abs(spectrum).argmax(), spectrum.shape)
            wavelength = 299792458.0 / (77.4201e9 + 60e12 * (7e-6 + 64 / 2.5e6))
            speed = ((doppler + size / 2) % size - size / 2) / size / (2 * 92e-6) * wavelength / 2
            range_m = beat / size * 2.5e6 / 60e12 * 299792458.0 / 2
            self.assertAlmostEqual(abs(speed), truth["speed_m_per_s"], delta=0.03, msg=f"seed {seed}")
            self.assertAlmostEqual(range_m, math.hypot(truth["x_m"], truth["y_m"]), delta=0.04, msg=f"seed {seed}")
            steps = np.angle(spectrum[doppler, beat].conj() *
                             np.fft.fft2(added[:, 0, :, 1], (size, size))[doppler, beat])
            sine = -steps / (2 * np.pi) * wavelength / 0.0019361
            self.assertAlmostEqual(math.asin(sine), math.atan2(truth["y_m"], truth["x_m"]), delta=0.05,
                                   msg=f"seed {seed}")

    def test_what_the_recording_gives_anyway_is_taken_out(self):
        place = lambda r, a: {**finding("moving_target"), "where": [{"range_m": [r - 0.1, r + 0.1],
                                                                    "azimuth_deg": [a - 5, a + 5]}]}
        untouched = [place(2.95, -7), place(2.97, 13)]
        third = place(1.5, 20)
        self.assertEqual(recordings.beyond([place(2.9, 12), third, place(2.95, -6)], untouched), [third])
        self.assertEqual(recordings.beyond([finding("packet_loss")], untouched), [finding("packet_loss")])
        self.assertEqual(recordings.beyond([], untouched), [])
        leaks = lambda level, half: finding("tx_rx_leakage", level_db=number(level, level - half, level + half))
        self.assertEqual(recordings.beyond([leaks(0.3, 0.2)], [leaks(0.0, 1.0)]), [])
        (sum_of_both,) = recordings.beyond([leaks(5.0, 0.5)], [leaks(0.0, 1.0)])
        self.assertEqual(sum_of_both["parameters"], {"level_db": number(5.0)})


if __name__ == "__main__":
    unittest.main()
