"""A program whose finished trials do not run again."""
import os
import signal

from mmradartwin_tests.exit_status import exit_status


def _stop(number, frame):
    """Ends the trial that runs, with its diagnosis and its session, on SIGTERM too and in the background of a shell."""
    raise KeyboardInterrupt


def run_resumable(parse, run):
    """Calls run(parse()) with the folder `output` made; returns the exit status."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _stop)
    arguments = parse()

    def make_and_run():
        if not arguments.output:
            raise ValueError("--output: is empty")
        os.makedirs(arguments.output, exist_ok=True)
        run(arguments)
    return exit_status(make_and_run, "stopped; the same call goes on where this one ended")
