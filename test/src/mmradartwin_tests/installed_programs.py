"""Finds programs of the sourced workspace."""
import os


def find_program(package, name):
    """Path of lib/PACKAGE/NAME in the sourced workspace, or None."""
    for prefix in os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep):
        path = os.path.join(prefix, "lib", package, name)
        if prefix and os.access(path, os.X_OK):
            return path
    return None
