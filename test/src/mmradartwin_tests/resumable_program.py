"""A program whose finished trials do not run again."""
import os
import signal
import sys


def _stop(number, frame):
    """Ends the trial that runs, with its diagnosis and its session, on SIGTERM too and in the background of a shell."""
    raise KeyboardInterrupt


def run_resumable(parse, run):
    """Calls run(parse()) with the folder `output` made; returns the exit status."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _stop)
    arguments = parse()
    try:
        if not arguments.output:
            raise ValueError("--output: is empty")
        os.makedirs(arguments.output, exist_ok=True)
        run(arguments)
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("stopped; the same call goes on where this one ended", file=sys.stderr)
        return 1
    return 0
