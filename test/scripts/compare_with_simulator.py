#!/usr/bin/env python3
"""Generates a full campaign with nothing hidden, simulates it, and compares the two path lists."""
import argparse
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

from mmradartwin_tests.arguments import whole
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.path_comparison import compare
from mmradartwin_tests.session import Measurement, Settings


def main():
    """Prints one row per tier; status 1 where the medians of isolated strong paths exceed 0.3 dB, 5 mm or 0.3 deg."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=whole(0), default=int.from_bytes(os.urandom(3), "little"))
    parser.add_argument("--poses", type=whole(1), help="fewer poses than the full campaign")
    arguments = parser.parse_args()
    program = find_program("mmradartwin_sim", "simulate")
    if program is None:
        print("error: mmradartwin_sim simulate is not in the sourced workspace", file=sys.stderr)
        return 2
    print(f"seed {arguments.seed}")
    print("poses    tier     paths missing extra isolated | median level dB  range mm  azimuth deg | worst level dB")
    status = 0
    with tempfile.TemporaryDirectory() as directory:
        for tier in ("exact", "default"):
            at = lambda name, tier=tier: os.path.join(directory, tier + name)
            Measurement(Settings(output=at("_session"), seed=arguments.seed, poses=arguments.poses, frames=1, tier=tier,
                                 paths_csv=at("_true"))).run()
            subprocess.run([program, at("_session"), "--output", at("_sim")], check=True, stdout=subprocess.DEVNULL,
                           stderr=subprocess.DEVNULL)
            # Duplicates are left out by the simulator as by every reader.
            for name in set(os.listdir(at("_true"))) - set(os.listdir(at("_sim/paths"))):
                os.remove(os.path.join(at("_true"), name))
            r = compare(at("_true"), at("_sim/paths"))
            m = r["median"]
            print(f"{r['poses']:5d} {tier:>8} {len(r['pairs']):8d} {len(r['missing']):7d} {len(r['extra']):5d} "
                  f"{r['isolated']:8d} | {m['level_db']:15.4f} {1e3 * m['range_m']:9.3f} {m['azimuth_deg']:12.4f} | "
                  f"{r['worst']['level_db']:13.4f}")
            if not (m["level_db"] <= 0.3 and m["range_m"] <= 0.005 and m["azimuth_deg"] <= 0.3):
                status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
