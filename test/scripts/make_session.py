#!/usr/bin/env python3
"""Writes a measured session: raw captures of the test office with the paper's radar, with hidden effects or none."""
import argparse
import math
import os
import sys

# Small matrices in several processes: threads inside each would only fight.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

from mmradartwin_tests import campaign, effects, session
from mmradartwin_tests.exit_status import exit_status
from mmradartwin_tests.output import STOPPED, check_new, new_folder


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
    parser.add_argument("--force", action="store_true", help="replace a session, truth and path lists that exist")
    return parser.parse_args()


def check(arguments):
    """ValueError for a number out of its range."""
    for name, least in (("locations", 1), ("headings", 1), ("frames", 1), ("duplicates", 0), ("jobs", 1), ("seed", 0),
                        ("speckle_seed", 0), ("pause", 0), ("strength", -math.inf)):
        value = getattr(arguments, name)
        if value is not None and not (math.isfinite(value) and value >= least):
            raise ValueError(f"--{name.replace('_', '-')} {value}: must be at least {least}")
    if arguments.poses is not None and not 1 <= arguments.poses <= arguments.locations * arguments.headings:
        raise ValueError(f"--poses {arguments.poses}: must be 1 to {arguments.locations * arguments.headings}")
    for option in ("truth", "paths_csv"):
        path = getattr(arguments, option)
        flag = "--" + option.replace("_", "-")
        if path is None:
            continue
        if os.path.realpath(path).startswith(os.path.realpath(arguments.output) + os.sep):
            raise ValueError(f"{flag} {path}: lies inside the session; choose a place outside")
        check_new(flag, path, arguments.force)
        if os.path.lexists(path) and os.path.isdir(path) != (option == "paths_csv"):
            raise ValueError(f"{flag} {path}: is {'a' if option == 'truth' else 'no'} folder")


def chosen_effects(arguments):
    """Effects of the options --effect, --param and --strength."""
    parameters = {name: {} for name in arguments.effect}
    for item in arguments.param:
        key, _, text = item.partition("=")
        owner, _, name = key.rpartition(".")
        owner = owner or (arguments.effect[0] if arguments.effect else "")
        if owner not in parameters or not text:
            raise ValueError(f"--param {item}: wants [EFFECT.]KEY=VALUE of an effect given with --effect")
        parameters[owner][name] = value_of(text)
        # By the unit in its name it is a number, or several.
        if isinstance(parameters[owner][name], str) and name.endswith(("_m", "_deg", "_db", "_hz", "_s")):
            raise ValueError(f"--param {item}: must be a number")
    return [effects.make_effect(name, parameters[name], arguments.strength if i == 0 else None)
            for i, name in enumerate(arguments.effect)]


def is_session(folder):
    return os.path.isfile(os.path.join(folder, "session.yaml"))


def main():
    """Entry point; returns the exit status."""
    arguments = parse()

    def measure():
        check(arguments)
        chosen = chosen_effects(arguments)
        with new_folder(arguments.output, arguments.force, is_session) as folder:
            settings = session.Settings(
                output=folder, seed=arguments.seed, locations=arguments.locations, headings=arguments.headings,
                frames=arguments.frames, poses=arguments.poses, tier=arguments.tier, speckle_seed=arguments.speckle_seed,
                pause_s=arguments.pause, duplicates=arguments.duplicates, effects=chosen, truth=arguments.truth,
                paths_csv=arguments.paths_csv, at_reported=arguments.at_reported, jobs=arguments.jobs)
            session.Measurement(settings).run()
    return exit_status(measure, STOPPED)


if __name__ == "__main__":
    sys.exit(main())
