"""The causes that a finding may name, as the shipped program simulate lists its mechanisms."""
import os
import re
import subprocess

from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.session import Measurement, Settings

PROGRAM = find_program("mmradartwin_sim", "simulate")
# What every twin has, what an unknown is written as, and what is simulated and never named.
NO_CAUSES = {"specular", "corner", "diffuse",
             "empirical_clutter", "empirical_echo", "empirical_frame_gain", "empirical_law", "empirical_tone", "echo_replica",
             "transmitter_coupling",
             "chirp_nonlinearity", "mutual_coupling", "phase_noise", "quantisation"}


def shipped_causes(folder):
    """Set of names; the folder is written to."""
    session, twin = os.path.join(folder, "session"), os.path.join(folder, "twin.yaml")
    Measurement(Settings(output=session, seed=1, poses=1, frames=1)).run()
    with open(twin, "w", encoding="ascii") as file:
        file.write(f"scene: {session}/scene.yaml\nmechanisms: {{no_such_thing: {{}}}}\n")
    run = subprocess.run([PROGRAM, session, "--twin", twin, "--output", os.path.join(folder, "out")],
                         capture_output=True, text=True, check=False, timeout=120)
    known = re.search(r"unknown mechanism no_such_thing; known: (.*)", run.stderr)
    if run.returncode != 2 or not known:
        raise RuntimeError(f"simulate ended with {run.returncode} and does not list its mechanisms: {run.stderr}")
    names = set(known.group(1).split(", "))
    if not NO_CAUSES <= names:
        raise RuntimeError(f"not among the program's mechanisms: {', '.join(sorted(NO_CAUSES - names))}")
    return names - NO_CAUSES
