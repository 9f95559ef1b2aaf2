"""A command at a terminal: what it shows, what is typed, and that the terminal is afterwards as it was."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import termios
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

WITHIN_S: Final = 180.0
"""For a busy machine."""
_MOVES: Final = re.compile(r"\x1b\[[0-9;?]*[a-zA-Z]")


def until(process: subprocess.Popen[bytes], screen: int, words: str) -> str:
    """What a process shows, without colours and moves, until it shows some words."""
    shown = b""
    deadline_s = time.monotonic() + WITHIN_S
    while words not in (plain := _MOVES.sub("", shown.decode(errors="replace"))):
        assert time.monotonic() < deadline_s, plain
        try:
            piece = os.read(screen, 65536)
        except OSError:  # the other end of a terminal is gone
            piece = b""
        assert piece or process.poll() is None, plain
        shown += piece
    return plain


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
    )
    yield process, ours
    assert termios.tcgetattr(theirs) == before, "the terminal is as it was"
    os.close(ours)
    os.close(theirs)
