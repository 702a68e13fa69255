"""Which of many sessions a run takes: a share of them, drawn anew each time, so that a landing does not take hours."""
import os
import random

SHARE = float(os.environ.get("MMRADARTWIN_SESSIONS_SHARE") or 0.3)
NOT_TAKEN = f"not among the {SHARE:.0%} of sessions that this run takes; MMRADARTWIN_SESSIONS_SHARE=1 takes all"


def is_taken():
    return random.random() < SHARE
