"""Which sessions of the diagnosis a run takes: fixed ones always, and in a long run a third of the others, by the day.

Three days in a row take all. MMRADARTWIN_LONG=long takes the day's third, MMRADARTWIN_LONG=all every one;
MMRADARTWIN_DAY=2026-01-31 repeats a day, which is printed. Of the causes of the catalogue a usual run takes the day's
half.
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
def print_day():
    """The line by which a run is repeated."""
    print(f"MMRADARTWIN_DAY={DAY}", file=sys.stderr, flush=True)


if RUN:
    print_day()


def is_taken(name, always=False):
    """True where this run takes the session of that name."""
    if always or RUN == "all":
        return True
    third = int.from_bytes(hashlib.sha256(name.encode()).digest()[:4], "big") % THIRDS
    return RUN == "long" and third == DAY.toordinal() % THIRDS


def is_of_half(index):
    """True where this run takes the index-th of a row of sessions: a long run takes all, a usual one every second. Two
    days in a row take all."""
    return bool(RUN) or index % 2 == DAY.toordinal() % 2


def every_run(test):
    """Decorator of a test that every run takes."""
    test.in_every_run = True
    return test


def seeds(*fixed):
    """The fixed seeds, and in a long run one of the day."""
    return fixed + ((int(DAY.strftime("%Y%m%d")),) if RUN else ())
