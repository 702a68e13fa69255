"""A number of a finding is judged by its own interval, and by a limit beside it."""
import unittest

from stated_error import assert_told

TOLD = {"value": 2.0, "ci95": [1.902, 2.098]}   # a standard deviation of 0.05


class StatedError(unittest.TestCase):
    def test_three_standard_deviations_are_allowed(self):
        for true in (1.86, 2.0, 2.14):
            assert_told(self, TOLD, true)
        for true in (1.84, 2.16):
            with self.assertRaisesRegex(AssertionError, f"not {true}"):
                assert_told(self, TOLD, true)

    def test_a_limit_counts_where_it_is_the_narrower(self):
        assert_told(self, TOLD, 2.09, most=0.1)
        with self.assertRaises(AssertionError):
            assert_told(self, TOLD, 2.11, most=0.1)

    def test_each_number_of_a_list_has_its_own_interval(self):
        told = {"value": [0.0, 2.0], "ci95": [[0.0, 0.0], [1.9, 2.1]]}
        assert_told(self, told, [0.0, 2.1])
        for true in ([0.1, 2.0], [0.0, 2.2]):
            with self.assertRaises(AssertionError):
                assert_told(self, told, true)
        with self.assertRaises(ValueError):
            assert_told(self, told, [0.0])


if __name__ == "__main__":
    unittest.main()
