"""Waiting for a condition ends with its value or, after the limit, with what was waited for."""
import time
import unittest

from wait_for import wait_for


class WaitFor(unittest.TestCase):
    def test_the_first_true_value_is_returned_at_once(self):
        values = iter([0, None, "there", "later"])
        start = time.monotonic()
        self.assertEqual(wait_for(lambda: next(values), "a value"), "there")
        self.assertLess(time.monotonic() - start, 30)

    def test_after_the_limit_it_is_told_what_was_waited_for(self):
        asked = []
        for what in ("the rig", lambda: "the rig"):
            with self.assertRaisesRegex(AssertionError, "the rig: not within 0.2 s"):
                wait_for(lambda: asked.append(1), what, 0.2)
        self.assertGreater(len(asked), 2)


if __name__ == "__main__":
    unittest.main()
