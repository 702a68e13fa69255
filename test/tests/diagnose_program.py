"""The program diagnose, run as a user runs it."""
import json
import os
import subprocess

from mmradartwin_tests.installed_programs import find_program

PROGRAM = find_program("mmradartwin_attribution", "diagnose")


def diagnose(session, output, *options):
    """Runs the program, in place of an earlier run; returns (exit status, findings or None, standard error)."""
    run = subprocess.run([PROGRAM, session, "--output", output, "--force", *options], capture_output=True, text=True,
                         check=False)
    file = os.path.join(output, "findings.json")
    findings = None
    if os.path.exists(file):
        with open(file, encoding="utf-8") as text:
            findings = json.load(text)
    return run.returncode, findings, run.stderr
