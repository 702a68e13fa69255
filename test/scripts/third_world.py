#!/usr/bin/env python3
"""Diagnoses sessions of the third world: rooms of rough patches, computed by physical optics, and a radar with faults.

Results stand in OUTPUT/results.jsonl, and a finished session does not run again. The table is printed at the end and
written to OUTPUT/table.md. Sessions and what was said of them stay in OUTPUT/sessions, and a session that is there is not
measured again.
"""
import argparse
import os
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

from mmradartwin_tests.blind.trials import Results
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.resumable_program import run_resumable
from mmradartwin_tests.third_world import campaign, hidden
from mmradartwin_tests.third_world.measured import PROPERTIES


def parse():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", required=True, help="folder of results and table")
    parser.add_argument("--what", default="clean,single",
                        help="rows, in turn: clean, single or names of causes (default: clean,single)")
    parser.add_argument("--seeds", default="0-99", metavar="FIRST-LAST", help="sessions of each row (default: 0-99)")
    parser.add_argument("--jobs", type=int, default=1, help="threads of one diagnosis")
    parser.add_argument("--without", default="", help="properties that the world lacks: " + ",".join(PROPERTIES))
    parser.add_argument("--budget", type=float, metavar="MINUTES", help="start no session after this time")
    parser.add_argument("--no-told", action="store_true", help="compare no twins that are told the truth")
    parser.add_argument("--table", action="store_true", help="run nothing, print the table of the results that exist")
    return parser.parse_args()


def seeds_of(text):
    """Numbers of FIRST-LAST or of one."""
    first, _, last = text.partition("-")
    if not first.isdigit() or (last and not last.isdigit()):
        raise ValueError(f"--seeds {text}: wants FIRST-LAST")
    return range(int(first), int(last or first) + 1)


def run(arguments):
    """Runs what is missing."""
    results = Results(os.path.join(arguments.output, "results.jsonl"), ("row", "status", "truths", "findings"))
    rows = arguments.what.split(",")
    for row in rows:
        if row not in ("clean", "single", *hidden.CAUSES):
            raise ValueError(f"--what {row}: is none of clean, single, {', '.join(hidden.CAUSES)}")
    without = [p for p in arguments.without.split(",") if p]
    for name in without:
        if name not in PROPERTIES:
            raise ValueError(f"--without {name}: is no property; there are {', '.join(PROPERTIES)}")
    if not arguments.table:
        program = find_program("mmradartwin_attribution", "diagnose")
        if program is None:
            raise ValueError("mmradartwin_attribution diagnose is not in the sourced workspace; build it first")
        start = time.monotonic()
        for seed in seeds_of(arguments.seeds):
            for row in rows:
                if f"{row}-{seed}" in results.records:
                    continue
                if arguments.budget is not None and time.monotonic() - start > 60 * arguments.budget:
                    break
                place = os.path.join(arguments.output, "sessions", f"{row}-{seed}")
                record = campaign.run_trial(seed, row, program, place, arguments.jobs, without,
                                            told=not arguments.no_told)
                results.add(record)
                print(campaign.text_of(record), flush=True)
    text = campaign.table_of(list(results.records.values()))
    with open(os.path.join(arguments.output, "table.md"), "w", encoding="utf-8") as out:
        out.write(text + "\n")
    print(text)


if __name__ == "__main__":
    sys.exit(run_resumable(parse, run))
