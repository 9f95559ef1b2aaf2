"""A witness that the machine itself stood still: nothing ran on a CPU, though the most urgent process wanted to.

A virtual machine's host may take a CPU away for tens of milliseconds, and firmware may. No scheduling priority inside
helps against that, so a silence of control that this explains says nothing about control. The witness is a process a
CPU, bound to it, above control's priority, that sleeps for a moment and looks at the clock, again and again. When it
wakes far too late, nothing below it ran on that CPU either.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from chauffeur.drive.live.realtime import FIFO_PRIORITY, lock_memory

_PRIORITY: Final = FIFO_PRIORITY + 10
_STEP_NS: Final = 4_000_000
_LATE_NS: Final = 6_000_000
"""Lateness that is told: a fraction of a control period."""
_LOOK_STEPS: Final = 25
"""Steps after which the kernel's count of stolen time is looked at anew."""
_TICKS_A_S: Final = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


@dataclass(frozen=True, slots=True)
class Stall:
    """A time in which a CPU ran nothing that wanted to run, by the clock of all processes.

    Attributes:
        cpu: Which.
        from_ns, to_ns: When the witness should have woken, and when it did.
        stolen_ms: How much of it the machine's host says it took; 0 where there is no host, or it does not say.
    """

    cpu: int
    from_ns: int
    to_ns: int
    stolen_ms: int


def stood_ns(stalls: Iterable[Stall], from_ns: int, to_ns: int) -> int:
    """For how much of a time some CPU stood still; times that overlap count once."""
    inside = sorted((max(one.from_ns, from_ns), min(one.to_ns, to_ns)) for one in stalls)
    total, reached = 0, from_ns
    for begun, ended in inside:
        total += max(0, ended - max(begun, reached))
        reached = max(reached, ended)
    return total


class Witness:
    """Witnesses on all CPUs of this process, from entering to leaving.

    Attributes:
        able: Whether the machine allows real-time scheduling; without it there is no witness, and nothing is excused.
    """

    def __init__(self) -> None:
        self.able = False
        self._stalls: list[Stall] = []
        self._lines: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._processes: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Self:
        if not hasattr(os, "sched_getaffinity"):
            return self
        for cpu in sorted(os.sched_getaffinity(0)):
            process = subprocess.Popen(  # noqa: S603 - this package's own process
                [sys.executable, "-m", __name__, str(cpu)], stdout=subprocess.PIPE, start_new_session=True
            )
            self._processes.append(process)
            threading.Thread(target=self._listen, args=(process,), daemon=True).start()
        ready = [self._lines.get() for _ in self._processes]
        self.able = bool(ready) and all("ready" in said for said in ready)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self._processes:
            process.kill()
        for process in self._processes:
            process.wait()

    @property
    def processes(self) -> tuple[int, ...]:
        """Ids of the witnesses, by CPU."""
        return tuple(process.pid for process in self._processes)

    def stalls(self, from_ns: int, to_ns: int) -> tuple[Stall, ...]:
        """What was seen between two instants."""
        with contextlib.suppress(queue.Empty):
            while True:
                said = self._lines.get_nowait()
                if "from_ns" in said:
                    self._stalls.append(Stall(**said))
        return tuple(one for one in self._stalls if one.to_ns > from_ns and one.from_ns < to_ns)

    def _listen(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None
        for line in process.stdout:
            self._lines.put(json.loads(line))
        self._lines.put({"over": process.pid})


def watch(cpu: int) -> None:
    """Watch one CPU, and say each stall as a JSON line; ends only with its process. Raises OSError: not allowed to."""
    os.sched_setaffinity(0, {cpu})
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    lock_memory()
    parent, before = os.getppid(), _stolen_ms(cpu)
    due = time.monotonic_ns() + _STEP_NS
    _say({"ready": cpu})
    for step in count(1):
        time.sleep(_STEP_NS / 1e9)
        now = time.monotonic_ns()
        late, from_ns = now - due > _LATE_NS, due
        due = now + _STEP_NS  # what is done until the next sleep is watched as well
        if late or step % _LOOK_STEPS == 0:
            stolen = _stolen_ms(cpu)
            if late:
                _say({"cpu": cpu, "from_ns": from_ns, "to_ns": now, "stolen_ms": stolen - before})
            before = stolen
            if os.getppid() != parent:
                return


def _stolen_ms(cpu: int) -> int:
    """Time that the host took from a CPU so far, as the kernel counts it."""
    for line in Path("/proc/stat").read_text(encoding="ascii").splitlines():
        if line.startswith(f"cpu{cpu} "):
            return int(line.split()[8]) * 1000 // _TICKS_A_S
    return 0


def _say(what: dict[str, int]) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    with contextlib.suppress(PermissionError, BrokenPipeError, KeyboardInterrupt):
        watch(int(sys.argv[1]))
