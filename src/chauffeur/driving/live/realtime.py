"""Keeping time: a fixed rate, the scheduler's help where it is allowed, and what lateness came of it."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import os
import time
from array import array
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np

FIFO_PRIORITY: Final = 10
"""Above all ordinary processes, below the kernel's own (50)."""
NICENESS: Final = -15
POLICY_NICENESS: Final = -10
"""Of the policy, which control does not wait for: before ordinary work, after control."""
_LOCK_NOW_AND_LATER: Final = 3
"""MCL_CURRENT | MCL_FUTURE of mlockall(2)."""
_KEPT: Final = 1 << 20

Scheduling = Literal["fifo", "nice", "default"]


@dataclass(frozen=True, slots=True)
class Realtime:
    """What the machine allowed.

    Attributes:
        scheduling: `fifo`: no ordinary process takes the core; `nice`: a larger share of it; `default`: as any other.
        memory_locked: Whether no page of the process is ever swapped out.
    """

    scheduling: Scheduling
    memory_locked: bool


def become_realtime(wanted: bool = True) -> Realtime:
    """Ask for real-time scheduling and locked memory, and turn garbage collection off; says what was allowed.

    Call it once everything is loaded: what exists then is never looked through again.
    """
    gc.collect()
    gc.freeze()
    gc.disable()
    if not wanted:
        return Realtime("default", memory_locked=False)
    scheduling: Scheduling = "default"
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
        scheduling = "fifo"
    except (OSError, AttributeError):
        if become_favoured(NICENESS):
            scheduling = "nice"
    return Realtime(scheduling, memory_locked=lock_memory())


def become_favoured(niceness: int = POLICY_NICENESS) -> bool:
    """Ask for a larger share of the core; whether it was given.

    Linux shares cores between sessions first (sched(7), autogroups), so a process that leads one asks for both.
    """
    try:
        os.setpriority(os.PRIO_PROCESS, 0, niceness)
    except OSError:
        return False
    if os.getsid(0) == os.getpid():
        with contextlib.suppress(OSError):  # a kernel without autogroups
            Path("/proc/self/autogroup").write_text(str(niceness))
    return True


def lock_memory() -> bool:
    """Keep every page of this process in memory, now and later; whether that was allowed."""
    try:
        return ctypes.CDLL(None).mlockall(_LOCK_NOW_AND_LATER) == 0
    except (OSError, AttributeError):
        return False


class Ticker:
    """Waits for the periods of a fixed rate. A period that began too late to be caught up with is given up, not run
    twice; lateness is kept for a report."""

    def __init__(self, period_s: float, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self._period_ns = round(period_s * 1e9)
        self._clock_ns = clock_ns
        self._due_ns = clock_ns() + self._period_ns
        self.lateness_ns: array[int] = array("q")
        self.missed = 0
        """Periods that were never begun, because the one before ended, or was woken, a whole period late."""

    def restart(self) -> None:
        """Count from now: after a pause that was meant."""
        self._due_ns = self._clock_ns() + self._period_ns

    def wait(self) -> int:
        """Sleep until the next period begins; returns how late it began, ns."""
        while (left := self._due_ns - self._clock_ns()) > 0:
            time.sleep(left / 1e9)
        late = self._clock_ns() - self._due_ns
        if len(self.lateness_ns) < _KEPT:
            self.lateness_ns.append(late)
        skipped = late // self._period_ns
        self.missed += skipped
        self._due_ns += (1 + skipped) * self._period_ns
        return late


@dataclass(frozen=True, slots=True)
class Punctuality:
    """How punctual a fixed rate was.

    Attributes:
        ticks: Periods begun.
        missed: Periods never begun.
        p50_ms, p99_ms, p999_ms, max_ms: Lateness of beginnings.
    """

    ticks: int
    missed: int
    p50_ms: float
    p99_ms: float
    p999_ms: float
    max_ms: float


def punctuality(lateness_ns: array[int], missed: int) -> Punctuality:
    """Figures of a ticker's lateness."""
    if not lateness_ns:
        return Punctuality(0, missed, 0.0, 0.0, 0.0, 0.0)
    late_ms = np.frombuffer(lateness_ns, dtype=np.int64) / 1e6
    p50, p99, p999 = (float(p) for p in np.percentile(late_ms, (50.0, 99.0, 99.9)))
    return Punctuality(len(late_ms), missed, p50, p99, p999, float(late_ms.max()))
