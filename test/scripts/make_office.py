#!/usr/bin/env python3
"""Writes office.obj, scene.yaml and materials.yaml of the test office."""
import argparse
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

from mmradartwin_tests import office

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", required=True, help="directory to write into")
    arguments = parser.parse_args()
    os.makedirs(arguments.output, exist_ok=True)
    office.write_scene(arguments.output)
