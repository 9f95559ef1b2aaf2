"""What the operating system adds around a sandbox worker: one core, few files, no core dumps, its processor time.

Linux only.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Final

_ADDRESS_SPACE_BYTES: Final = 2 << 30
_OPEN_FILES: Final = 32


def present_core() -> int | None:
    """Number of the core this process runs on just now, None where that cannot be known."""
    try:
        fields = Path("/proc/self/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        return int(fields[36])
    except (OSError, IndexError, ValueError):
        return None


@contextlib.contextmanager
def on_core(core: int | None) -> Generator[None]:
    """Keep this thread, and all it starts meanwhile, on a core. None does nothing."""
    if core is None or not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {core})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


@contextlib.contextmanager
def uninterrupted() -> Generator[None]:
    """Threads started meanwhile never take Ctrl-C: it is the main thread's, which may be waiting for an answer."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def processor_time(pid: int | None) -> Callable[[], float]:
    """A clock of the processor time a process has used, s; it stands still once the process is gone.

    Where the platform does not tell (only Linux does), wall time.
    """
    if pid is None or not sys.platform.startswith("linux"):
        return time.perf_counter
    number, used_s = (~pid << 3) | 2, 0.0  # clock_getcpuclockid(3)

    def clock() -> float:
        nonlocal used_s
        with contextlib.suppress(OSError):
            used_s = time.clock_gettime(number)
        return used_s

    return clock


def confine(pid: int, core: int | None) -> None:
    """Put a second fence around a worker from outside, and keep it on a core."""
    with contextlib.suppress(OSError, ValueError, ImportError):  # no such platform, or the worker is already gone
        import resource

        resource.prlimit(pid, resource.RLIMIT_CORE, (0, 0))
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (_OPEN_FILES, _OPEN_FILES))
        resource.prlimit(pid, resource.RLIMIT_AS, (_ADDRESS_SPACE_BYTES, _ADDRESS_SPACE_BYTES))
        for thread in Path(f"/proc/{pid}/task").iterdir():
            # Never real time, even if the host is: a spinning program must not keep its own watchdog from running.
            os.sched_setscheduler(int(thread.name), os.SCHED_OTHER, os.sched_param(0))
            if core is not None:
                os.sched_setaffinity(int(thread.name), {core})
