"""How a program of the tests ends."""
import sys


def exit_status(run, stopped):
    """Calls run(). 0 where it ends well, 2 for bad input, 1 where it was stopped; says why, `stopped` in the last case."""
    try:
        run()
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(stopped, file=sys.stderr)
        return 1
    return 0
