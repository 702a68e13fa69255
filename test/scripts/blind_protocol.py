#!/usr/bin/env python3
"""The blind protocol: hides effects in generated sessions and in a real recording, and scores what diagnose returns.

Truths are sealed in OUTPUT/ledger.jsonl before the diagnosis runs; results stand in OUTPUT/results.jsonl, and a
finished trial does not run again. The table is printed at the end and written to OUTPUT/table.md.
"""
import argparse
import os
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

from mmradartwin_tests.blind import draws, ledger, recordings, table, trials
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.resumable_program import run_resumable

# Of rows with several effects, this many of each; of the other rows, this many in all.
TRIALS = {"clean": 100, "single": 8, "later": 8, "faint": 6, "pair": 40, "twice": 2, "outside": 3, "decoy": 5,
          "recording": 3}
EFFECTS = {"clean": 1, "single": len(draws.SINGLE), "later": len(draws.LATER), "faint": len(draws.FAINT), "pair": 1,
           "twice": len(draws.TWICE), "outside": len(draws.OUTSIDE), "decoy": len(draws.DECOYS),
           "recording": len(recordings.INJECTIONS)}

NEEDS = ("row", "tier", "poses", "frames", "status", "findings", "seconds")


def parse():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", required=True, help="folder of ledger, truths, results and table")
    parser.add_argument("--rows", default="all", help="all, or some of " + ",".join(draws.ROWS))
    parser.add_argument("--trials", default="", metavar="ROW=N,...",
                        help="how many of a row, of each effect where a row has several (default: " +
                        ",".join(f"{row}={n}" for row, n in TRIALS.items()) + ")")
    parser.add_argument("--seed", type=int, default=1, help="of all trials")
    parser.add_argument("--poses", type=int, default=44, help="per session, up to 154 (full campaign: 22 places)")
    parser.add_argument("--frames", type=int, default=20, help="per pose")
    parser.add_argument("--tier", choices=("office", "clean"), default="office")
    parser.add_argument("--budget", type=float, metavar="MINUTES", help="start no trial that would end later")
    parser.add_argument("--limit", type=float, default=600.0, metavar="S", help="longest time of one diagnosis")
    parser.add_argument("--jobs", type=int, default=1, help="threads of one diagnosis")
    parser.add_argument("--table", action="store_true", help="run nothing, print the table of the results that exist")
    return parser.parse_args()


def wanted_trials(arguments):
    """{row: number of trials}; ValueError for what is not a row or a number."""
    rows = draws.ROWS if arguments.rows == "all" else arguments.rows.split(",")
    counts = dict(TRIALS)
    for item in filter(None, arguments.trials.split(",")):
        row, _, number = item.partition("=")
        if row not in counts or not number.isdigit():
            raise ValueError(f"--trials {item}: wants ROW=N with a row of {', '.join(draws.ROWS)}")
        counts[row] = int(number)
    for row in rows:
        if row not in draws.ROWS:
            raise ValueError(f"--rows {row}: is no row; rows: {', '.join(draws.ROWS)}")
    if not 2 <= arguments.poses <= 154:
        raise ValueError(f"--poses {arguments.poses}: must be 2 to 154")
    if arguments.frames < 2:
        raise ValueError(f"--frames {arguments.frames}: must be at least 2")
    return {row: counts[row] * EFFECTS[row] for row in rows}


def in_turn(counts):
    """(row, number) of all trials, rows advancing evenly, so that a table of a part is one of all rows."""
    order = [((i + 0.5) / n, row, i) for row, n in counts.items() for i in range(n)]
    return [(row, i) for _, row, i in sorted(order)]


def line_of(record, truths):
    """One trial in one line of text."""
    numbers = lambda v: ("[" + " ".join(str(numbers(x)) for x in v) + "]" if isinstance(v, list) else
                         f"{v:.4g}" if isinstance(v, float) else v)
    hidden = "; ".join(t["cause"] + " " + ", ".join(f"{k}={numbers(v)}" for k, v in t["parameters"].items())
                       for t in truths) or "nothing"
    said = []
    for f in record["findings"]:
        names = ", ".join(f"{c['cause']} {c['probability']:.2g}" for c in f.get("candidates") or [])
        values = ", ".join(f"{k}={numbers(p['value'])}" for k, p in f["parameters"].items())
        said.append(f"{f['cause']} {values} [{names}]" + (f" ({f['description'][:160]})" if f["cause"] == "unknown"
                                                          else ""))
    answer = "; ".join(said) or ("nothing" if record["status"] == "ok" else f"{record['status']}: {record['log']}")
    return f"{record['key']} {record['seconds']:.0f} s | hidden: {hidden} | said: {answer}"


def print_table(output, results, sealed):
    """Prints the tables of all campaigns among the results and writes them to OUTPUT/table.md."""
    parts = []
    campaigns = sorted({(r["tier"], r["poses"], r["frames"]) for r in results.records.values()})
    for tier, poses, frames in campaigns:
        records = [r for r in results.records.values() if (r["tier"], r["poses"], r["frames"]) == (tier, poses, frames)]
        scores = table.Scores(records, sealed)
        parts += [f"### {tier} tier, {poses} poses of {frames} frames, {len(records)} trials",
                  table.markdown(table.HEAD, scores.table()),
                  table.markdown(("row", "hidden", "right", "first finding"), scores.by_cause()),
                  table.markdown(("parameter", "95 % intervals that hold the truth", "values"), scores.by_parameter()),
                  table.markdown(("name, where nothing is hidden", "fitted", "most nats", "trial"),
                                 scores.by_name_where_nothing_is())]
        if len(scores.coverage()) >= 5:
            with open(os.path.join(output, f"quantiles_{tier}_{poses}.svg"), "w", encoding="utf-8") as out:
                out.write(table.quantile_plot(scores.coverage()))
    text = "\n\n".join(parts) + "\n"
    with open(os.path.join(output, "table.md"), "w", encoding="utf-8") as out:
        out.write(text)
    print(text)


def run(arguments):
    """Runs what is missing."""
    counts = wanted_trials(arguments)
    sealed = ledger.Ledger(arguments.output)
    results = trials.Results(os.path.join(arguments.output, "results.jsonl"), NEEDS)
    if not arguments.table:
        program = find_program("mmradartwin_attribution", "diagnose")
        if program is None:
            raise ValueError("mmradartwin_attribution diagnose is not in the sourced workspace; build it first")
        if "recording" in counts and recordings.capture_file() is None:
            print("openradar_indoor is not here (MMRADARTWIN_DATA): the row recording is left out", file=sys.stderr)
            del counts["recording"]
        todo = [draws.Trial(row, arguments.tier, arguments.seed, i, arguments.poses, arguments.frames)
                for row, i in in_turn(counts)]
        todo = [t for t in todo if t.key() not in results.records]
        start = time.monotonic()
        for done, trial in enumerate(todo):
            spent = time.monotonic() - start
            each = spent / done if done else 0.0
            if arguments.budget is not None and spent + each > 60 * arguments.budget:
                print(f"the budget of {arguments.budget:g} min is spent; {len(todo) - done} trials are left for "
                      "another call", file=sys.stderr)
                break
            print(f"trial {done + 1} of {len(todo)}" + (f", {each * (len(todo) - done) / 60:.0f} min left" if done
                                                        else ""), file=sys.stderr, flush=True)
            record = trials.run_trial(trial, sealed, program, arguments.limit, arguments.jobs)
            results.add(record)
            print(line_of(record, sealed.open(record["key"])["effects"]), flush=True)
    print_table(arguments.output, results, sealed)


if __name__ == "__main__":
    sys.exit(run_resumable(parse, run))
