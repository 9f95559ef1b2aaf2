"""The `chauffeur` command, and `python -m chauffeur`: Ctrl-C ends it without a traceback, from the first moment on."""

import signal
import sys

STOPPED_WITH_CTRL_C = 130


def run() -> None:
    """Entry point of the `chauffeur` script."""
    try:
        from chauffeur.cli.main import run as command  # takes a moment, in which Ctrl-C comes, too

        command()
    except KeyboardInterrupt:
        sys.exit(STOPPED_WITH_CTRL_C)
    finally:
        # All is closed; threads that the interpreter waits for now are none that Ctrl-C should show a traceback of.
        signal.signal(signal.SIGINT, signal.SIG_DFL)


if __name__ == "__main__":
    run()
