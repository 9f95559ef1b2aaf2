"""Time for a drive: a clock that is passed in, and a schedule that counts the periods it could not begin in time."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """What a drive takes its time from. Both are called from more than one thread."""

    def now_s(self) -> float:
        """Seconds since some fixed instant."""
        ...

    def wait_until(self, at_s: float) -> None:
        """Come back at that instant, or at once when it has passed."""
        ...


class WallClock:
    """This machine's time."""

    def now_s(self) -> float:
        """Seconds since some fixed instant; never goes back."""
        return time.monotonic()

    def wait_until(self, at_s: float) -> None:
        """Sleep until then."""
        time.sleep(max(0.0, at_s - time.monotonic()))


LATE_S = 0.02
"""A period that begins later than this after its due time counts as a missed deadline."""


class DrivePace:
    """The fixed rate of a drive. After a long delay it goes on from now: time lost is lost, nothing is hurried after.

    Attributes:
        late: Driven periods that began more than `LATE_S` after they were due.
        worst_late_s: The largest such delay.
    """

    def __init__(self, clock: Clock, period_s: float) -> None:
        self._clock = clock
        self._period_s = period_s
        self._due_s = clock.now_s() + period_s
        self.late = 0
        self.worst_late_s = 0.0

    def await_period(self, *, driven: bool) -> None:
        """Sleep until the next tick; lateness is counted only where `driven`."""
        self._clock.wait_until(self._due_s)
        delay_s = self._clock.now_s() - self._due_s
        if driven and delay_s > LATE_S:
            self.late += 1
            self.worst_late_s = max(self.worst_late_s, delay_s)
        self._due_s += self._period_s if delay_s < self._period_s else delay_s + self._period_s
