#!/usr/bin/env python3
"""Writes a scan of a known room as a phone or a scanner would leave it: a PLY file, with its faults."""
import argparse
import dataclasses
import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

from mmradartwin_tests.arguments import whole
from mmradartwin_tests.exit_status import exit_status
from mmradartwin_tests.output import STOPPED, check_new
from mmradartwin_tests.scans import scan_files
from mmradartwin_tests.scans.degraded_scan import DEGRADATIONS, make_scan
from mmradartwin_tests.scans.known_room import ROOMS


def parse():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", required=True, help="PLY file to write")
    parser.add_argument("--room", choices=list(ROOMS), default="office", help="(default: office)")
    parser.add_argument("--kind", choices=list(DEGRADATIONS), default="phone", help="how it was scanned (default: phone)")
    parser.add_argument("--seed", type=whole(0), default=1, help="of places, noise and holes (default: 1)")
    parser.add_argument("--size", type=whole(1000), help="triangles or points, about (default: as its kind has)")
    parser.add_argument("--truth", help="file for the room and the scan's frame (JSON)")
    parser.add_argument("--force", action="store_true", help="replace files that exist")
    return parser.parse_args()


def main():
    """Entry point; returns the exit status."""
    arguments = parse()

    def write():
        check_new("--output", arguments.output, arguments.force)
        if arguments.truth is not None:
            check_new("--truth", arguments.truth, arguments.force)
        asked = DEGRADATIONS[arguments.kind]
        if arguments.size:
            asked = dataclasses.replace(asked, size=arguments.size)
        room = ROOMS[arguments.room]()
        scan = make_scan(room, asked, arguments.seed)
        scan_files.write_ply(arguments.output, scan)
        if arguments.truth is not None:
            scan_files.write_truth(arguments.truth, room, scan)
        what = f"{len(scan.points)} points" if scan.faces is None else f"{len(scan.faces)} triangles"
        print(f"{arguments.output}: {what}, scan '{arguments.kind}' of the room '{arguments.room}'")
    return exit_status(write, STOPPED)


if __name__ == "__main__":
    sys.exit(main())
