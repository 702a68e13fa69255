"""Numbers of a finding, judged by the error that the finding itself states."""
import math

# An interval of 95 % reaches 1.96 standard deviations. Three are allowed: of the hundred numbers that tests compare,
# five lie outside their own intervals, and none outside this.
DEVIATIONS = 3


def assert_told(test, told, true, most=math.inf, deviations=DEVIATIONS, msg=""):
    """The parameter {value, ci95}, a number or a list, is the true one within so many of its own standard deviations, and
    never off by more than `most`."""
    values, intervals, truths = told["value"], told["ci95"], true
    if not isinstance(values, list):
        values, intervals, truths = [values], [intervals], [true]
    for value, (low, high), wanted in zip(values, intervals, truths, strict=True):
        test.assertTrue(low <= value <= high, msg=f"{told} {msg}")
        allowed = min(most, deviations / 1.96 * max(high - value, value - low))
        test.assertLessEqual(abs(value - wanted), allowed, msg=f"{told}, not {true} {msg}")
