"""Progress of a run, as shown while it works."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Final

_WINDOW_S: Final = 60.0


@dataclass(frozen=True, slots=True)
class Standing:
    """A run at one instant.

    Attributes:
        planned: Items of the run.
        asked: Items with a plan, or whose planner failed.
        done: Items that need nothing more: driven, or failed before that.
        driven: Items that were driven or refused, so that the running scores count them.
        successes, collisions: Of those.
        failed: Items without a result because something other than the policy failed.
        requests: Requests sent, earlier runs in the same folder included.
        usd: Money spent, where prices are known.
        in_flight: Planner calls in flight.
        window: How many may be.
        held_s: Seconds until the endpoint may be asked again; 0 when it may.
        rate: Items done a second, over the last minute.
        eta_s: Seconds to go at that rate; None when nothing can be said.
    """

    planned: int
    asked: int = 0
    done: int = 0
    driven: int = 0
    successes: int = 0
    collisions: int = 0
    failed: int = 0
    requests: int = 0
    usd: float = 0.0
    in_flight: int = 0
    window: int = 0
    held_s: float = 0.0
    rate: float = 0.0
    eta_s: float | None = None

    @property
    def completion(self) -> float | None:
        """Share of driven items that succeeded, so far."""
        return self.successes / self.driven if self.driven else None

    @property
    def collision(self) -> float | None:
        """Share of driven items that collided, so far."""
        return self.collisions / self.driven if self.driven else None


@dataclass(slots=True)
class Speedometer:
    """Rate of a count over the last minute; times in seconds of a clock that is passed in."""

    _seen: deque[tuple[float, int]] = field(default_factory=deque[tuple[float, int]])

    def rate(self, now_s: float, count: int) -> float:
        """Take a reading; counts a second since the oldest kept one."""
        self._seen.append((now_s, count))
        while len(self._seen) > 2 and now_s - self._seen[1][0] > _WINDOW_S:
            self._seen.popleft()
        then_s, before = self._seen[0]
        return (count - before) / (now_s - then_s) if now_s > then_s else 0.0
