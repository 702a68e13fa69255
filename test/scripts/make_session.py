#!/usr/bin/env python3
"""Writes a measured session: raw captures of the test office with the paper's radar, with hidden effects or none."""
import argparse
import os
import sys

# Small matrices in several processes: threads inside each would only fight.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

from mmradartwin_tests import campaign, effects, session


def value_of(text):
    """Number, list of numbers (a,b,c) or text."""
    parts = text.split(",")
    try:
        numbers = [float(p) for p in parts]
    except ValueError:
        return text
    return numbers if len(numbers) > 1 else numbers[0]


def parse():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", required=True, help="session directory to write")
    parser.add_argument("--seed", type=int, required=True, help="of poses, noise and all that is random")
    parser.add_argument("--locations", type=int, default=22)
    parser.add_argument("--headings", type=int, default=7, help="per location")
    parser.add_argument("--poses", type=int, help="thin the campaign to this many poses, without duplicates")
    parser.add_argument("--frames", type=int, default=100, help="per pose")
    parser.add_argument("--pause", type=float, default=8.0,
                        help="mean pause between poses, s (between places four times)")
    parser.add_argument("--duplicates", type=int, help="repeated poses at the end (default 2 in a full campaign)")
    parser.add_argument("--tier", choices=sorted(campaign.POSE_ERROR), default="default",
                        help="size of errors in the description")
    parser.add_argument("--speckle-seed", type=int, help="of the rough surfaces' phases alone (default: the seed)")
    parser.add_argument("--at-reported", action="store_true",
                        help="measure at the reported poses: the ceiling of any twin")
    parser.add_argument("--effect", action="append", default=[], help="hidden effect by its name; may be repeated")
    parser.add_argument("--strength", type=float, help="of the first effect, 1 = its typical size")
    parser.add_argument("--param", action="append", default=[], metavar="KEY=VALUE",
                        help="parameter of the first effect, or EFFECT.KEY=VALUE")
    parser.add_argument("--truth", help="file for what the session hides (JSON); never inside the session")
    parser.add_argument("--paths-csv", help="directory for the true path lists; never inside the session")
    parser.add_argument("--jobs", type=int, help="processes")
    return parser.parse_args()


def main():
    """Entry point; returns the exit status."""
    arguments = parse()
    try:
        parameters = {name: {} for name in arguments.effect}
        for item in arguments.param:
            key, _, text = item.partition("=")
            owner, _, name = key.rpartition(".")
            owner = owner or (arguments.effect[0] if arguments.effect else "")
            if owner not in parameters or not text:
                raise ValueError(f"--param {item}: wants [EFFECT.]KEY=VALUE of an effect given with --effect")
            parameters[owner][name] = value_of(text)
        chosen = [effects.make_effect(name, parameters[name], arguments.strength if i == 0 else None)
                  for i, name in enumerate(arguments.effect)]
        for name in ("locations", "headings", "frames"):
            if getattr(arguments, name) < 1:
                raise ValueError(f"--{name} {getattr(arguments, name)}: must be at least 1")
        if arguments.poses is not None and not 1 <= arguments.poses <= arguments.locations * arguments.headings:
            raise ValueError(f"--poses {arguments.poses}: must be 1 to {arguments.locations * arguments.headings}")
        for option in ("truth", "paths_csv"):
            path = getattr(arguments, option)
            if path and os.path.realpath(path).startswith(os.path.realpath(arguments.output) + os.sep):
                flag = "--" + option.replace("_", "-")
                raise ValueError(f"{flag} {path}: lies inside the session; choose a place outside")
        settings = session.Settings(
            output=arguments.output, seed=arguments.seed, locations=arguments.locations, headings=arguments.headings,
            frames=arguments.frames, poses=arguments.poses, tier=arguments.tier, speckle_seed=arguments.speckle_seed,
            pause_s=arguments.pause, duplicates=arguments.duplicates, effects=chosen, truth=arguments.truth,
            paths_csv=arguments.paths_csv, at_reported=arguments.at_reported, jobs=arguments.jobs)
        session.Measurement(settings).run()
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
