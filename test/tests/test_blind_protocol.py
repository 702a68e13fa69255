"""The blind protocol itself: sealed truths, draws, resumed trials; not how well the diagnosis does."""
import hashlib
import json
import os
import signal
import stat
import subprocess
import sys
import unittest

import numpy as np

from mmradartwin_tests import effects
from mmradartwin_tests.blind import draws, trials
from mmradartwin_tests.blind.ledger import Ledger, LedgerError
from mmradartwin_tests.session import Measurement, Settings
from in_folder import InFolder
from wait_for import wait_for

HERE = os.path.dirname(os.path.realpath(__file__))
PROTOCOL = os.path.join(HERE, "..", "scripts", "blind_protocol.py")


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

        def ended():
            try:
                with open(f"/proc/{pid}/stat", encoding="ascii") as text:
                    return text.read().rsplit(")", 1)[1].split()[0] == "Z"
            except FileNotFoundError:
                return True

        wait_for(ended, "the grandchild's end", 60)


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
            wait_for(lambda: os.path.exists(told) or run.poll() is not None, "the program's start")
            self.assertIsNone(run.poll(), "it ended by itself")
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
        self.assertFalse(set(draws.SINGLE) & set(draws.LATER))
        for row, drawn in (("single", draws.SINGLE), ("later", draws.LATER)):
            half = len(drawn)
            names = [draws.draw(draws.Trial(row, "office", 3, i))[0][0] for i in range(2 * half)]
            self.assertEqual(sorted(names[:half]), sorted(drawn))
            self.assertEqual(sorted(names[half:]), sorted(drawn))
            self.assertTrue(half < 5 or names[:half] != names[half:])

    def test_draws_repeat_and_differ_by_seed_and_trial(self):
        drawn = [draws.draw(draws.Trial("pair", "office", seed, i)) for seed in (1, 2) for i in range(40)]
        again = [draws.draw(draws.Trial("pair", "office", seed, i)) for seed in (1, 2) for i in range(40)]
        self.assertEqual(drawn, again)
        self.assertGreater(len({json.dumps(d) for d in drawn}), 70)
        seeds = {draws.Trial(row, tier, seed, i).session_seed()
                 for row in draws.ROWS for tier in ("office", "clean") for seed in (1, 2) for i in range(50)}
        self.assertEqual(len(seeds), 4 * len(draws.ROWS) * 50)

    def test_all_that_is_drawn_can_be_hidden(self):
        for row, count in (("single", len(draws.SINGLE)), ("later", len(draws.LATER)), ("decoy", len(draws.DECOYS)), ("pair", 3),
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


if __name__ == "__main__":
    unittest.main()
