"""Which sessions of the diagnosis a run takes: fixed ones always, and in a long run a third of the others, by the day.

Three days in a row take all. MMRADARTWIN_LONG=long takes the day's third, MMRADARTWIN_LONG=all every one;
MMRADARTWIN_DAY=2026-01-31 repeats a day, which a long run prints.
"""
import datetime
import hashlib
import os
import sys

THIRDS = 3
RUN = os.environ.get("MMRADARTWIN_LONG", "")
DAY = datetime.date.fromisoformat(os.environ.get("MMRADARTWIN_DAY") or datetime.date.today().isoformat())
NOT_TAKEN = ("of the long run" if not RUN else f"not of {DAY}") + "; MMRADARTWIN_LONG=all takes every session"

if RUN not in ("", "long", "all"):
    raise ValueError(f"MMRADARTWIN_LONG is long or all, not '{RUN}'")
if RUN:
    print(f"MMRADARTWIN_DAY={DAY}", file=sys.stderr, flush=True)


def is_taken(name, always=False):
    """True where this run takes the session of that name."""
    if always or RUN == "all":
        return True
    third = int.from_bytes(hashlib.sha256(name.encode()).digest()[:4], "big") % THIRDS
    return RUN == "long" and third == DAY.toordinal() % THIRDS


def every_run(test):
    """Decorator of a test that every run takes."""
    test.in_every_run = True
    return test


def seeds(*fixed):
    """The fixed seeds, and in a long run one of the day."""
    return fixed + ((int(DAY.strftime("%Y%m%d")),) if RUN else ())
