#!/usr/bin/env python3
"""The twin's recall beside its ceiling, pooled over generated campaigns with nothing hidden.

Ceiling: the generator against itself with other phases of the rough surfaces, measured at the true poses, and at the
reported ones (all that a twin can know of where the radar stood).
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

from mmradartwin_tests.arguments import whole
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.session import Measurement, Settings

BANDS = ("near", "mid", "far")
BRANCHES = ("twin", "ceiling", "ceiling at reported poses")


def main():
    """Prints the table; status 1 where |Q3 median| exceeds 0.5 dB or a pooled recall is below 0.95 of the ceiling."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=whole(0), default=int.from_bytes(os.urandom(3), "little"))
    parser.add_argument("--sessions", type=whole(1), default=3)
    parser.add_argument("--poses", type=whole(1), help="fewer poses than the full campaign")
    arguments = parser.parse_args()
    program = find_program("mmradartwin_attribution", "evaluate")
    if program is None:
        print("error: mmradartwin_attribution evaluate is not in the sourced workspace", file=sys.stderr)
        return 2
    print(f"seeds {arguments.seed} to {arguments.seed + arguments.sessions - 1}")
    counts = {branch: {band: [0, 0] for band in BANDS} for branch in BRANCHES}
    q3 = {branch: [] for branch in BRANCHES}
    for seed in range(arguments.seed, arguments.seed + arguments.sessions):
        with tempfile.TemporaryDirectory() as directory:
            at = lambda name: os.path.join(directory, name)
            common = {"seed": seed, "poses": arguments.poses}
            Measurement(Settings(output=at("measured"), **common)).run()
            Measurement(Settings(output=at(BRANCHES[1]), speckle_seed=seed + 1, **common)).run()
            Measurement(Settings(output=at(BRANCHES[2]), speckle_seed=seed + 1, at_reported=True, **common)).run()
            for branch in BRANCHES:
                command = [program, at("measured"), "--output", at("out"), "--force", "--no-pictures", "--no-bag"]
                command += [] if branch == "twin" else ["--simulated", at(branch)]
                subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                with open(os.path.join(at("out"), "summary.json"), encoding="ascii") as file:
                    central = json.load(file)["central"]
                q3[branch].append(central["q3_median_db"])
                for band in BANDS:
                    counts[branch][band][0] += central["recall_by_band"][band]["recalled"]
                    counts[branch][band][1] += central["recall_by_band"][band]["active"]
    status = 0
    print(f"{'':28}" + "".join(f"{band:>16}" for band in (*BANDS, "all")) + f"{'worst Q3 median':>20}")
    share = {}
    for branch in BRANCHES:
        pairs = [counts[branch][band] for band in BANDS]
        pairs.append([sum(p[i] for p in pairs) for i in (0, 1)])
        share[branch] = [a / max(b, 1) for a, b in pairs]
        worst = max(q3[branch], key=abs)
        cells = "".join(f"{s:8.3f} ({b:5d})" for s, (_, b) in zip(share[branch], pairs))
        print(f"{branch:28}{cells}{worst:17.2f} dB")
        if branch == "twin" and abs(worst) > 0.5:
            status = 1
    for branch in BRANCHES[1:]:
        ratio = [a / b if b else float("nan") for a, b in zip(share["twin"], share[branch])]
        print(f"{'twin / ' + branch:28}" + "".join(f"{r:16.3f}" for r in ratio))
    if min(a / b if b else 1.0 for a, b in zip(share["twin"], share["ceiling"])) < 0.95:
        status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
