"""Runs that take sessions by the day: the same day takes the same ones, and three days in a row take all."""
import os
import subprocess
import sys
import unittest

HERE = os.path.dirname(os.path.realpath(__file__))
NAMES = [f"session_{i}" for i in range(60)]
ASK = (f"import sys; sys.path.insert(0, {HERE!r}); import chosen_sessions as c; "
       f"print(*[n for n in {NAMES!r} if c.is_taken(n, n == 'session_7')]); print(*c.seeds(1, 2)); "
       "print(*[i for i in range(9) if c.is_of_half(i)])")


def asked(**environment):
    """(names of sessions that a run takes, seeds, standard error, indices of its half)."""
    kept = {k: v for k, v in os.environ.items() if k not in ("MMRADARTWIN_LONG", "MMRADARTWIN_DAY")}
    run = subprocess.run([sys.executable, "-c", ASK], env={**kept, **environment}, capture_output=True, text=True,
                         check=False, timeout=60)
    names, seeds, half = run.stdout.splitlines() if run.returncode == 0 else ("", "", "")
    return names.split(), seeds.split(), run.stderr, half.split()


class ChosenSessions(unittest.TestCase):
    def test_a_usual_run_takes_the_fixed_ones_whatever_the_day(self):
        for day in ("2026-03-01", "2026-03-02", "2026-03-03"):
            self.assertEqual(asked(MMRADARTWIN_DAY=day)[:3], (["session_7"], ["1", "2"], ""))

    def test_two_days_in_a_row_take_both_halves_and_a_long_run_both(self):
        one, other = (asked(MMRADARTWIN_DAY=day)[3] for day in ("2026-02-28", "2026-03-01"))
        self.assertEqual({len(one), len(other)}, {4, 5})
        self.assertEqual(set(one) | set(other), {str(i) for i in range(9)})
        self.assertEqual(len(asked(MMRADARTWIN_LONG="long", MMRADARTWIN_DAY="2026-03-01")[3]), 9)

    def test_a_long_run_takes_a_third_that_the_day_chooses_and_prints_the_day(self):
        first = asked(MMRADARTWIN_LONG="long", MMRADARTWIN_DAY="2026-03-01")
        self.assertEqual(first, asked(MMRADARTWIN_LONG="long", MMRADARTWIN_DAY="2026-03-01"))
        self.assertEqual(first[1:3], (["1", "2", "20260301"], "MMRADARTWIN_DAY=2026-03-01\n"))
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
