"""The program ``granchain``: the same code, exit codes and bytes as the binary."""

from __future__ import annotations

import os
import signal
import sys

from ._granchain import run_program


def _run(subcommand: str | None) -> int:
    # The program has handlers of its own: Ctrl-C ends it with 130 and leaves what a resumed run takes up.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    program = os.path.basename(sys.argv[0])
    typed = ["granchain" if program == "__main__.py" else program, *sys.argv[1:]]
    return run_program(typed, subcommand)


def main() -> int:
    """Run ``granchain``; returns its exit code."""
    return _run(None)


def calibrate() -> int:
    """Run ``granchain calibrate``; returns its exit code."""
    return _run("calibrate")


if __name__ == "__main__":
    sys.exit(main())
