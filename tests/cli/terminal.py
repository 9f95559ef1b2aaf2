"""A command at a terminal: what it shows, what is typed, and that the terminal is afterwards as it was."""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import subprocess
import termios
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

WITHIN_S: Final = 180.0
"""For a busy machine."""
_LOOK_S: Final = 1.0
"""How often is looked whether the process still runs."""
_MOVES: Final = re.compile(r"\x1b\[[0-9;?]*[a-zA-Z]")


def until(process: subprocess.Popen[bytes], screen: int, words: str) -> str:
    """What a process shows, without colours and moves, until it shows some words, however its lines are broken."""
    shown = b""
    deadline_s = time.monotonic() + WITHIN_S
    while words not in " ".join((plain := _MOVES.sub("", shown.decode(errors="replace"))).split()):
        left_s = deadline_s - time.monotonic()
        assert left_s > 0.0, plain
        ready, _, _ = select.select([screen], [], [], min(left_s, _LOOK_S))
        try:
            piece = os.read(screen, 65536) if ready else b""
        except OSError:  # the other end of a terminal is gone
            piece = b""
        assert piece or process.poll() is None, plain
        shown += piece
    return plain


def _hear_ctrl_c() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def at_a_terminal(command: Sequence[str]) -> Iterator[tuple[subprocess.Popen[bytes], int]]:
    """The process, and the end of its terminal where a person sits."""
    ours, theirs = pty.openpty()
    before = termios.tcgetattr(theirs)
    process = subprocess.Popen(
        command,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env=os.environ | {"TERM": "xterm", "COLUMNS": "110", "LINES": "40"},
        # Ctrl-C is heard also where tests run in the background.
        preexec_fn=_hear_ctrl_c,  # noqa: PLW1509 - the child has one thread
    )
    try:
        yield process, ours
        assert termios.tcgetattr(theirs) == before, "the terminal is as it was"
    finally:
        if process.poll() is None:
            process.kill()
            process.wait(timeout=WITHIN_S)
        os.close(ours)
        os.close(theirs)
