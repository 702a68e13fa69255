"""Waiting for what a test needs, instead of for a time that a busy machine makes too short."""
import time

PATIENCE_S = 300  # of a loaded machine
LOOK_EVERY_S = 0.1


def wait_for(condition, what, seconds=PATIENCE_S):
    """First true value of condition(). After so many seconds AssertionError, which tells what; that may be a function."""
    deadline = time.monotonic() + seconds
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            raise AssertionError(f"{what() if callable(what) else what}: not within {seconds} s")
        time.sleep(LOOK_EVERY_S)
