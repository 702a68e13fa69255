#!/usr/bin/env python3
"""Writes office.obj, scene.yaml and materials.yaml of the test office."""
import argparse
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

from mmradartwin_tests import office
from mmradartwin_tests.exit_status import exit_status
from mmradartwin_tests.output import STOPPED, new_folder

FILES = {"office.obj", "scene.yaml", "materials.yaml"}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", required=True, help="folder to write")
    parser.add_argument("--force", action="store_true", help="replace an office that exists")
    arguments = parser.parse_args()

    def write():
        with new_folder(arguments.output, arguments.force, lambda folder: set(os.listdir(folder)) == FILES) as folder:
            office.write_scene(folder)
    return exit_status(write, STOPPED)


if __name__ == "__main__":
    sys.exit(main())
