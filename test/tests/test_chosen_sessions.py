"""Runs that take sessions by the day: the same day takes the same ones, and three days in a row take all."""
import os
import subprocess
import sys
import unittest

HERE = os.path.dirname(os.path.realpath(__file__))
NAMES = [f"session_{i}" for i in range(60)]
ASK = (f"import sys; sys.path.insert(0, {HERE!r}); import chosen_sessions as c; "
       f"print(*[n for n in {NAMES!r} if c.is_taken(n, n == 'session_7')]); print(*c.seeds(1, 2))")


def asked(**environment):
    """(names of sessions that a run takes, seeds, standard error)."""
    kept = {k: v for k, v in os.environ.items() if k not in ("MMRADARTWIN_LONG", "MMRADARTWIN_DAY")}
    run = subprocess.run([sys.executable, "-c", ASK], env={**kept, **environment}, capture_output=True, text=True,
                         check=False, timeout=60)
    names, seeds = run.stdout.splitlines() if run.returncode == 0 else ("", "")
    return names.split(), seeds.split(), run.stderr


class ChosenSessions(unittest.TestCase):
    def test_a_usual_run_takes_the_fixed_ones_whatever_the_day(self):
        for day in ("2026-03-01", "2026-03-02", "2026-03-03"):
            self.assertEqual(asked(MMRADARTWIN_DAY=day), (["session_7"], ["1", "2"], ""))

    def test_a_long_run_takes_a_third_that_the_day_chooses_and_prints_the_day(self):
        first = asked(MMRADARTWIN_LONG="long", MMRADARTWIN_DAY="2026-03-01")
        self.assertEqual(first, asked(MMRADARTWIN_LONG="long", MMRADARTWIN_DAY="2026-03-01"))
        self.assertEqual(first[1:], (["1", "2", "20260301"], "MMRADARTWIN_DAY=2026-03-01\n"))
        taken = [set(asked(MMRADARTWIN_LONG="long", MMRADARTWIN_DAY=f"2026-03-0{d}")[0]) for d in (1, 2, 3)]
        self.assertEqual(set.union(*taken), set(NAMES))
        for one in taken:
            self.assertIn("session_7", one)
            self.assertTrue(10 <= len(one) <= 30, msg=f"{len(one)} of {len(NAMES)}")
        self.assertEqual(set.intersection(*taken), {"session_7"})

    def test_all_takes_every_session(self):
        self.assertEqual(asked(MMRADARTWIN_LONG="all", MMRADARTWIN_DAY="2026-03-01")[0], NAMES)

    def test_another_word_is_an_error(self):
        self.assertIn("MMRADARTWIN_LONG is long or all, not '1'", asked(MMRADARTWIN_LONG="1")[2])


if __name__ == "__main__":
    unittest.main()
