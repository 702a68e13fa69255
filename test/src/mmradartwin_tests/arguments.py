"""Types of argparse: numbers within bounds. What is wrong is told with the option's name."""
import argparse
import math


def whole(least):
    """A whole number of at least so much."""
    def of(text):
        try:
            value = int(text)
        except ValueError:
            value = None
        if value is None or value < least:
            raise argparse.ArgumentTypeError(f"'{text}' must be a whole number of at least {least}")
        return value
    return of


def positive(text):
    """A finite number above 0."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f"'{text}' must be a number above 0")
    return value
