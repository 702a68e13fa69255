"""Sessions of the generator, made by its program as a user makes them."""
import subprocess

from mmradartwin_tests.installed_programs import find_program


def make_session(session, locations, frames, *more):
    """Writes the session directory; one heading a location."""
    subprocess.run([find_program("mmradartwin_tests", "make_session.py"), "--output", session, "--seed", "31",
                    "--headings", "1", "--locations", str(locations), "--frames", str(frames), *more],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=600)
