"""A sample of the blind protocol: how often the diagnosis is right, not where it is.

A usual run takes the same seed every time; a long run also one of the day, which nobody has seen. There a miss is no
failure: bounds are what a diagnosis with the rates of the README passes 99 times of 100.
"""
import os
import sys
import tempfile
import unittest

from mmradartwin_tests.blind import draws, trials
from mmradartwin_tests.blind.ledger import Ledger
from mmradartwin_tests.blind.scoring import score
from mmradartwin_tests.installed_programs import find_program
from chosen_sessions import seeds

PROGRAM = find_program("mmradartwin_attribution", "diagnose")
SEED = 1
ROWS = {"single": 4, "pair": 1, "outside": 1, "clean": 1}
# At 92 % each, fewer than 4 of the 7 things hidden are found once in 850 samples; at 2 % a session, more than one of
# the 7 has something wrong once in 130.
LEAST_FOUND = 4
MOST_WRONG = 1


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class BlindSample(unittest.TestCase):
    def test_what_is_hidden_is_found_and_nothing_else(self):
        given = os.environ.get("MMRADARTWIN_SAMPLE_SEED")
        for seed in (int(given),) if given else seeds(SEED):
            with self.subTest(seed=seed):
                self.check_sample(seed)

    def check_sample(self, seed):
        again = f"MMRADARTWIN_SAMPLE_SEED={seed}"   # the last line of a failure is the one that summaries show
        told, found, wrong = [], 0, 0
        print(again, file=sys.stderr, flush=True)
        with tempfile.TemporaryDirectory() as folder:
            sealed = Ledger(folder)
            for row, number in ((row, i) for row, n in ROWS.items() for i in range(n)):
                record = trials.run_trial(draws.Trial(row, "office", seed, number, poses=24), sealed, PROGRAM, jobs=2)
                truths = sealed.open(record["key"])["effects"]
                scores = score(row, truths, record["findings"])
                found += sum(scores.get("named", [scores.get("unknown", False)]))
                wrong += scores["wrong"] if row != "clean" else scores["alarm"]
                told.append(f"{row}: {' and '.join(t['cause'] for t in truths) or 'nothing'} was hidden, "
                            f"{', '.join(f['cause'] for f in record['findings']) or 'nothing'} was found")
                print(told[-1], file=sys.stderr, flush=True)
                self.assertEqual(record["status"], "ok", msg="\n".join(told + record.get("log", []) + [again]))
        self.assertGreaterEqual(found, LEAST_FOUND, msg="\n".join(told + [again]))
        self.assertLessEqual(wrong, MOST_WRONG, msg="\n".join(told + [again]))


if __name__ == "__main__":
    unittest.main()
