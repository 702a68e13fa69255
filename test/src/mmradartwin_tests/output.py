"""Where the generator writes: what a person has stays, and nothing half written stands under a result's name."""
import contextlib
import os
import shutil
import signal

STOPPED = "error: stopped; nothing is written"   # what a program says that writes into new_folder()


def check_new(option, path, force=False):
    """ValueError where `path` cannot be a new file or folder, or exists without `force`."""
    if not path:
        raise ValueError(f"{option}: is empty")
    if os.path.lexists(path) and not force and not (os.path.isdir(path) and not os.listdir(path)):
        raise ValueError(f"{option} {path}: exists; --force replaces it")
    above = os.path.dirname(os.path.abspath(path))
    while not os.path.lexists(above):
        above = os.path.dirname(above)
    if not os.path.isdir(above):
        raise ValueError(f"{option} {path}: {above} is no folder")


def raise_interrupt(*_):
    raise KeyboardInterrupt


@contextlib.contextmanager
def new_folder(path, force, is_one):
    """A folder beside `path`, which takes that name when the block has ended well and is gone otherwise.

    With `force` it replaces a folder for which is_one(folder) is true, and nothing else.
    """
    check_new("--output", path, force)
    path = os.path.abspath(path)
    if os.path.lexists(path) and not (os.path.isdir(path) and not os.path.islink(path)):
        raise ValueError(f"--output {path}: is no folder")
    if os.path.isdir(path) and os.listdir(path) and not is_one(path):
        raise ValueError(f"--output {path}: holds something else, which is not replaced")
    above, name = os.path.split(path)
    beside = os.path.join(above, f".{name[:100]}.{os.getpid()}")
    signal.signal(signal.SIGTERM, raise_interrupt)
    os.makedirs(above, exist_ok=True)
    if len(os.fsencode(name)) > os.pathconf(above, "PC_NAME_MAX"):
        raise ValueError(f"--output {path}: its name is too long")
    os.mkdir(beside)
    try:
        yield beside
        if os.path.isdir(path) and os.listdir(path):
            older = beside + ".older"
            os.rename(path, older)
            os.rename(beside, path)
            shutil.rmtree(older)
        else:
            os.rename(beside, path)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
