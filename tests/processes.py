"""Processes that end with the test that starts them, and waiting for a state, never for a time."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, Final

WITHIN_S: Final = 120.0
"""For a busy machine."""
_LOOK_S: Final = 0.01


def until(state: Callable[[], object], what: str, within_s: float = WITHIN_S) -> None:
    """Wait until something is so; fails when it does not come to pass in time."""
    end_s = time.monotonic() + within_s
    while not state():
        assert time.monotonic() < end_s, f"{what}: not within {within_s:g} s"
        time.sleep(_LOOK_S)


def end(process: subprocess.Popen[Any]) -> None:
    """End a process that leads a session, with everything that it started and left in there."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait(timeout=WITHIN_S)


@contextmanager
def started(command: Sequence[str], **how: Any) -> Iterator[subprocess.Popen[Any]]:
    """A process in a session of its own; nothing of it is left afterwards."""
    process = subprocess.Popen(command, start_new_session=True, **how)
    try:
        yield process
    finally:
        end(process)
        for stream in (process.stdin, process.stdout, process.stderr):
            if stream is not None:
                stream.close()


def finished(command: Sequence[str], **how: Any) -> subprocess.CompletedProcess[str]:
    """What a command that ends by itself says and how it ends; its group is ended where it does not."""
    with started(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how) as process:
        out, err = process.communicate(timeout=WITHIN_S)
        return subprocess.CompletedProcess(command, process.returncode, out, err)
